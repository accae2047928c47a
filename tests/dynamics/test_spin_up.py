"""Rows A, A': beams spun up, one condensed body against converged segments, the steady stretch, and linear strain."""

from dataclasses import replace

import numpy as np
import pytest
from support.spin_up import KANE, TIMES, WU_HAUG


def converged(case, times):
    """Tip history of the segmented model, extrapolated from 16 and 32 segments (its error falls as 1/k^2)."""
    coarse, fine = case.segmented(16, times), case.segmented(32, times)
    assert np.abs(fine - coarse).max() < 2e-3 * np.abs(fine).max()
    return fine + (fine - coarse) / 3


MANY = (5, "auto", "all")  # derivatives of a segment: from its stretch alone to bending shapes that follow stretch
CASES = {"Kane": KANE, "Wu and Haug": WU_HAUG, "inclined": replace(KANE, tilt=0.06)}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_condensed_body_matches_segments_in_spin_up(name):
    case = CASES[name]
    reference = converged(case, TIMES)
    peak = np.abs(reference).max()
    assert 0.02 < peak / case.length < 0.1
    tip = case.single_body("condensed", y=3, z=5 if case.tilt else 0)
    assert np.abs(tip - reference).max() < 3e-3 * peak


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_meshed_body_matches_segments_in_spin_up(name):
    """Condensed strain leaves out what v'^4 / 8 shortens; with nonlinear strain the two formulations are one."""
    case = CASES[name]
    reference = converged(case, TIMES)
    peak = np.abs(reference).max()
    condensed, nonlinear = case.meshed("condensed", 8), case.meshed("nonlinear", 12, elements=12, rtol=1e-7)
    assert np.abs(condensed - reference).max() < 2e-3 * peak
    assert np.abs(condensed).max() == pytest.approx(np.abs(reference).max(), rel=1.1e-3)
    assert np.abs(nonlinear - reference).max() < 1e-4 * peak


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Kane", "inclined"])
def test_few_large_deflection_segments_in_spin_up(name):
    """Each bends by a part of the angle: what is of fifth order in the energy of one body is far less in two."""
    case = CASES[name]
    coarse, fine = (case.segmented(k, rtol=1e-7) for k in (16, 32))
    reference = fine + (fine - coarse) / 3
    peak = np.abs(reference).max()
    for k, strain, keep in ((2, "nonlinear", "auto"), *((k, "condensed", keep) for k in (2, 4, 8) for keep in MANY)):
        assert np.abs(case.segments_with_modes(k, strain, keep=keep) - reference).max() < 1e-3 * peak, (k, strain, keep)


@pytest.mark.slow
def test_segments_with_condensed_and_nonlinear_strain_agree():
    times = np.linspace(0, 7, 71)
    for k in (2, 8):
        reference = KANE.segments_with_modes(k, "nonlinear", times=times)
        for keep in MANY:
            tip = KANE.segments_with_modes(k, "condensed", times=times, keep=keep)
            assert np.abs(tip - reference).max() < 3e-4 * np.abs(reference).max(), (k, keep)


@pytest.mark.slow
@pytest.mark.parametrize("modes", [18, 24])
def test_many_modes_with_stretch_in_spin_up(modes):
    """18 modes were 5.7 % too stiff; here they are as near as eight."""
    times = np.linspace(0, 9, 91)
    coarse, fine = (KANE.segmented(k, times, rtol=1e-7) for k in (8, 16))
    reference = fine + (fine - coarse) / 3
    peak = np.abs(reference).max()
    tip = KANE.meshed("condensed", modes, times=times)
    assert np.abs(tip - reference).max() < 3e-3 * peak
    assert np.abs(tip).max() == pytest.approx(peak, rel=2e-3)


def test_spun_up_beam_has_steady_stretch():
    tip = KANE.single_body("condensed", y=2, axial=3)
    late = TIMES > 15.0
    assert tip[late, 0].mean() == pytest.approx(KANE.stretch, rel=5e-3)
    assert KANE.stretch == pytest.approx(5.143e-4, rel=1e-4)
