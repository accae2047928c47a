"""Beams whose sections have a product of inertia: the same as those given along their principal axes."""

from __future__ import annotations

from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import STEEL, frequencies, read

NORMAL, ACROSS, TURNED = 8e-7, 3e-7, radians(25.0)  # principal moments [m^4], and the angle to the first axis


def beam(folder: Path, *, turned: float, moments: tuple[float, float, float], more: str, n: int = 4) -> np.ndarray:
    """Frequencies of a cantilever of CBEAM along x whose section's y axis is turned about x from the basic y axis."""
    y = f"0.,{cos(turned):.14f},{sin(turned):.14f}"
    I1, I2, I12 = moments
    cards = [f"GRID,{k + 1},,{0.25 * k},0.,0." for k in range(n + 1)]
    cards += [f"CBEAM,{k + 1},3,{k + 1},{k + 2},{y}" for k in range(n)]
    cards += [f"PBEAM,3,1,1.E-3,{I1:.14E},{I2:.14E},{I12:.14E},9.E-7,6.", ",,,,,,,,", more, STEEL, "SPC1,1,123456,1"]
    return frequencies(read(folder, *cards), 6)


def places(y: float, z: float, turned: float) -> tuple[float, float]:
    """Components of a point of the section along axes that are turned by an angle."""
    return cos(turned) * y + sin(turned) * z, cos(turned) * z - sin(turned) * y


@pytest.mark.parametrize(("mass", "centroid"), [((0.03, -0.01), (0.0, 0.0)), ((0.0, 0.0), (0.02, 0.012))])
def test_centres_of_a_skew_section_stay_where_they_are(tmp_path: Path, mass, centroid):
    """Nonstructural mass or neutral axis off the shear centre, as components along the element's axes."""
    mean, half = (NORMAL + ACROSS) / 2, (NORMAL - ACROSS) / 2
    skew = (mean + half * cos(2 * TURNED), mean - half * cos(2 * TURNED), half * sin(2 * TURNED))

    def places_of(turned: float) -> str:
        m, c = places(*mass, turned), places(*centroid, turned)
        return f",0.5,0.5,,,,,,,{m[0]:.12f},{m[1]:.12f},,,{c[0]:.12f},{c[1]:.12f}"

    def lines(turned: float) -> str:
        words = places_of(turned).split(",")[1:]
        return "," + ",".join(words[:8]) + "\n," + ",".join(words[8:])

    given = beam(tmp_path, turned=0.0, moments=skew, more=lines(0.0))
    principal = beam(tmp_path, turned=TURNED, moments=(NORMAL, ACROSS, 0.0), more=lines(TURNED))
    assert given == pytest.approx(principal, rel=1e-8)
    plain = beam(tmp_path, turned=0.0, moments=skew, more=",0.5,0.5")
    assert abs(given / plain - 1).max() > 1e-3


def test_shear_factors_of_a_skew_section_are_of_its_planes(tmp_path: Path):
    """A product of inertia of next to nothing changes nothing, whichever of I1 and I2 is the larger."""
    for I1, I2 in ((NORMAL, ACROSS), (ACROSS, NORMAL)):
        plain = beam(tmp_path, turned=0.0, moments=(I1, I2, 0.0), more=",0.9,0.02")
        skew = beam(tmp_path, turned=0.0, moments=(I1, I2, 1e-13), more=",0.9,0.02")
        other = beam(tmp_path, turned=0.0, moments=(I1, I2, 0.0), more=",0.02,0.9")
        assert skew == pytest.approx(plain, rel=1e-6)
        assert abs(other / plain - 1).max() > 1e-2
