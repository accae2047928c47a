"""Row B: flap and lag frequencies of rotating cantilevers, condensed bodies against exact eigenvalues."""

import numpy as np
import pytest
from rotating_beams import Rotating

N = 12  # coordinates along each direction of bending: eight frequencies within 1e-5


def halved(x):
    """Mass of a beam half as deep at the tip."""
    return 1 - 0.5 * x


def eighth(x):
    """Its bending stiffness."""
    return (1 - 0.5 * x) ** 3


BEAMS = {
    "still": Rotating(0.0, lag=1.9),
    "slow": Rotating(2.0, lag=1.9),
    "fast, on a hub": Rotating(12.0, hub=1.0),
    "tapered": Rotating(6.0, lag=1.9, mass=halved, bending=eighth),
    "at a setting angle": Rotating(6.0, lag=3.0, setting=0.5),
    "fast": Rotating(12.0),
    "tapered, set, fast, on a hub": Rotating(12.0, 1.0, 1.0, 2.5, halved, eighth, 0.4),
}
SHORT = ("slow", "tapered", "at a setting angle")


@pytest.mark.parametrize("name", [pytest.param(k, marks=() if k in SHORT else pytest.mark.slow) for k in BEAMS])
def test_frequencies_of_rotating_beams_are_the_exact_ones(name):
    beam = BEAMS[name]
    found = beam.frequencies(N, 8)  # flap and lag, the first four of each
    assert found == pytest.approx(beam.exact(found), rel=1e-5)


def test_the_misfit_vanishes_at_published_and_closed_form_frequencies():
    still = np.array([1.875104068711961, 4.694091132974175]) ** 2
    assert Rotating(0.0, lag=1.9).exact(still * (1 + 3e-5)) == pytest.approx(still, rel=1e-8)
    flap = Rotating(2.0, lag=1.9).exact(np.array([4.1373]))  # Wright et al. 1982
    assert flap == pytest.approx([4.1373], abs=5e-5)
