"""Curved panels and arches in ten coordinates, their own static responses among them, snap as all elements do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from support.full_solution import Reduced, held_at
from support.nonlinear_models import METAL
from test_large_deflection import PINS, H, arch, load_off, panel, snapped

from femflex.advice.curved import curvature_note
from femflex.fem import Member, build_structure
from femflex.mesh import rectangle
from femflex.reduction import (
    cantilever_modes,
    free_free_modes,
    least_stiffness_ratio,
    strain_tensors,
    with_attachment,
    with_derivatives,
    with_responses,
)

CLAMPED = ("x", "y", "z", "rx", "ry", "rz")
ENDS, EDGES = ("left", "right"), ("left", "right", "bottom", "top")
HINGES = dict.fromkeys(ENDS, PINS)


def limit_loads(at, loads):
    """Loads at which a path of loads over displacements turns."""
    curve = CubicSpline(at, loads)
    return curve(curve.derivative().roots(extrapolate=False))


def responding(structure, clamp, modes, count, deflection):
    shapes = with_attachment(structure, cantilever_modes(structure, clamp, modes), ["z"])
    return with_responses(structure, shapes, count, deflection, ["z"])


CASES = {
    "arch, hinged": (lambda: arch(3 * H), dict.fromkeys(("start", "end"), PINS), 1),
    "arch, clamped": (lambda: arch(3 * H), dict.fromkeys(("start", "end"), CLAMPED), 1),
    "panel, barely curved": (lambda: panel(1.5 * H, 6), ENDS, 0),
    "panel, clamped": (lambda: panel(3 * H, 6), ENDS, 2),
    "square panel, clamped": (lambda: panel(3 * H, 6, 1.0), ENDS, 2),
    "square panel, clamped all round": (lambda: panel(2 * H, 6, 1.0), EDGES, 0),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.slow
def test_ten_coordinates_of_the_lowest_modes_and_responses_snap_through_as_all_elements_do(name):
    """To four thicknesses: the load at equal deflections within 1 % of the largest, both limit points too."""
    make, clamp, turns = CASES[name]
    structure = make()
    middle = [0.5, structure.mesh.points[:, 1].mean(), 1]
    case = snapped(structure, clamp, middle, 0.4 * H)
    load, row, factors, deflections = case
    assert deflections[-1] > 4.0
    shapes = responding(structure, clamp, 1, 8, 6 * H)
    assert shapes.n_modes == 10 and shapes.kinds.count("response") == 8
    assert load_off(structure, shapes, case) < 0.01
    at = np.linspace(0, deflections[-1], 200)[1:]
    found = held_at(Reduced(strain_tensors(structure, shapes.phi)), shapes.phi.T @ load, shapes.phi.T @ row, at)
    path = CubicSpline([0.0, *deflections], [0.0, *factors])(at)
    assert np.abs(found - path).max() < 0.01 * factors.max()  # on the symmetric path, not off it to where it buckles
    exact, own = limit_loads(deflections, factors), limit_loads(at, found)
    if turns:
        assert np.abs(own[:turns] - exact[:turns]).max() < 0.01 * np.ptp([*exact[:turns], 0.0])


@pytest.mark.slow
def test_so_does_a_hinged_panel_whose_corners_curl():
    structure = panel(2 * H, 6, supports=HINGES)
    case = snapped(structure, HINGES, [0.5, 0.25, 1], 0.3 * H)
    assert load_off(structure, responding(structure, HINGES, 1, 8, 4.5 * H), case) < 0.01


@pytest.mark.slow
def test_derivatives_at_rest_in_the_same_number_do_not():
    structure, clamp = arch(3 * H), dict.fromkeys(("start", "end"), PINS)
    case = snapped(structure, clamp, [0.5, 0, 1], 0.5 * H)
    modes = with_attachment(structure, cantilever_modes(structure, clamp, 2), ["z"])
    assert load_off(structure, with_derivatives(structure, modes, 8), case) > 0.1
    assert load_off(structure, with_responses(structure, modes, 8, 6 * H, ["z"]), case) < 0.01


def test_the_direction_left_out_is_the_one_that_moves_the_structure_most():
    structure, clamp = panel(2 * H, 4), ENDS
    modes = cantilever_modes(structure, clamp, 1)
    found, named = (with_responses(structure, modes, 3, H, ways) for ways in ((), ("z",)))
    np.testing.assert_array_equal(found.phi, named.phi)
    assert "3 response shapes of" in found.note
    np.testing.assert_allclose(found.phi.T @ (structure.M @ found.phi), np.eye(4), atol=1e-9)
    with pytest.raises(ValueError, match="responses are static states of a clamped structure"):
        with_responses(structure, free_free_modes(structure, 2), 3, H)


def test_a_curved_body_says_what_its_derivatives_do_not_hold_and_a_flat_one_nothing():
    curved = panel(2 * H, 4)
    said = curvature_note(curved, cantilever_modes(curved, ENDS, 2))
    assert "rise 0.02 m" in said and "responses = 8, deflection = '0.06 m'" in said and "snap-through" in said
    mesh = rectangle(1.0, 0.5, 4, 2, "triangle")
    flat = build_structure(mesh, [Member("surface", "plate", H, METAL)])
    for clamp in (ENDS, ("left",)):
        assert least_stiffness_ratio(flat, cantilever_modes(flat, clamp, 3)) == pytest.approx(1.0)
        assert curvature_note(flat, cantilever_modes(flat, clamp, 3)) == ""
    assert curvature_note(curved, cantilever_modes(curved, ("left",), 3)) == ""  # free to flatten
