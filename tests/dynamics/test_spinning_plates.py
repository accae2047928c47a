"""Plates on a spinning hub: reduced bodies against all finite elements, and these against Ritz's method and beams."""

from dataclasses import replace

import numpy as np
import pytest
from support.ritz_plates import ritz_frequencies
from support.rotating_beams import Rotating
from support.spinning_plates import Rise, SpinningPlate

SQUARE = SpinningPlate(hub=0.3)
PANEL = SpinningPlate(width=0.6, hub=0.2, cells=(8, 5))
FLAP, FLIGHT = 0.0, 90.0  # setting angles [deg]
RISE = Rise(5.0, 10.0)
slow = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("setting", [FLAP, FLIGHT])
def test_spinning_plate_full_model_matches_ritz(setting):
    """With 8 x 8 elements and 8 x 8 polynomials, at a spin of 10."""
    plate = replace(SQUARE, setting=setting, cells=(8, 8))
    found = plate.all_elements.frequencies(10.0, 5)
    assert found == pytest.approx(ritz_frequencies(plate, 10.0, 5, n=8), rel=4e-4)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("setting", [FLAP, FLIGHT])
def test_narrow_plate_matches_rotating_beam(setting):
    plate = SpinningPlate(width=0.05, thickness=0.002, nu=0.0, hub=0.5, setting=setting, cells=(12, 1))
    stiff = {"lag": 1e6} if setting == FLAP else {"flap": 1e6}
    for gamma in (2.0, 10.0):
        found = plate.all_elements.frequencies(gamma, 2)
        assert found == pytest.approx(Rotating(gamma, hub=0.5, **stiff).exact(found), rel=4e-5)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("setting", [FLAP, FLIGHT])
def test_spinning_plate_frequencies_with_twelve_coordinates(setting):
    plate = replace(PANEL, setting=setting)
    body = plate.body(9)
    assert body.n_modes == 12
    for gamma, within in ((2.0, 5e-5), (5.0, 3e-4), (10.0, 1e-3)):
        assert plate.frequencies(body, gamma, 6) == pytest.approx(plate.all_elements.frequencies(gamma, 6), rel=within)


@slow
def test_spinning_square_plate_frequencies():
    for setting in (FLAP, FLIGHT):
        plate = replace(SQUARE, setting=setting)
        exact = plate.all_elements.frequencies(10.0, 5)
        assert plate.frequencies(plate.body(9), 10.0, 5) == pytest.approx(exact, rel=1e-3)
        assert plate.frequencies(plate.body(6, "nonlinear"), 10.0, 4) == pytest.approx(exact[:4], rel=1.5e-3)


@pytest.mark.slow
def test_inclined_plate_is_bent_and_twisted_by_spin():
    """By 1.6 thicknesses at the corner; pairs of derivatives that steady bending wants are kept by number."""
    plate = replace(PANEL, setting=45.0)
    moved = plate.all_elements.steady(4.0, 4)
    assert np.abs(plate.structure.translation[:, plate.all_elements.free] @ moved).max() > 1.5 * plate.thickness
    exact = plate.all_elements.frequencies(4.0, 5)
    assert plate.frequencies(plate.body(9, keep=38), 4.0, 5) == pytest.approx(exact, rel=5e-4)
    assert plate.frequencies(plate.body(9), 4.0, 5) == pytest.approx(exact, rel=2.5e-3)


def extrapolated(plate, rise, times, groups=("top_right",)):
    """Corners (n_t, 3 k) of all finite elements, from two time steps (their error falls as the square)."""
    finer = np.linspace(times[0], times[-1], 2 * len(times) - 1)
    coarse, fine = plate.full_corners(rise, times, groups), plate.full_corners(rise, finer, groups)[::2]
    assert np.abs(fine - coarse).max() < 5e-3 * np.abs(fine).max()
    return fine + (fine - coarse) / 3


def history(plate, rise, times, modes):
    """Of the corner: reference, condensed body, and the peak."""
    reference = extrapolated(plate, rise, times)
    body = plate.body(modes, third=1)
    return reference, plate.corner(body, rise, times), np.linalg.norm(reference, axis=1).max()


@pytest.mark.slow
def test_condensed_plate_matches_full_model_in_spin_up():
    """Past the largest bend, of four thicknesses."""
    plate = SpinningPlate(width=0.6, thickness=0.02, hub=0.2, setting=60.0, cells=(3, 2))
    reference, found, peak = history(plate, RISE, np.linspace(0.0, 5.0, 111), 4)
    assert 0.06 < peak < 0.1
    assert np.abs(found - reference).max() < 5e-3 * peak


@pytest.mark.slow
def test_foreshortening_of_plate_corner_matches_full_model():
    """Within 0.3 % of the peak; without the static stretch 3 %. Sideways with modes in its plane alone: 1 %."""
    plate = SpinningPlate(width=0.6, thickness=0.02, hub=0.2, setting=60.0, cells=(3, 2))
    times = np.linspace(0.0, 5.0, 111)
    reference = extrapolated(plate, RISE, times)
    size = np.abs(reference).max(axis=0)
    for modes, within in ((4, [8e-3, 0.5, 2e-3]), (9, [3e-3, 2e-2, 1e-3])):
        body = plate.body(modes, third=1)
        found = plate.corner(body, RISE, times)
        assert np.all(np.abs(found - reference).max(axis=0) < within * size)
        bare = replace(body, markers={"corner": replace(body.markers["corner"], stretch=np.zeros((3, 4, 3)))})
        assert np.abs(plate.corner(bare, RISE, times) - reference)[:, 0].max() > 2e-2 * size[0]
