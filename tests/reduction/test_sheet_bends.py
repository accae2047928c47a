"""Wide thin sheets bent far: reduced bodies against the full nonlinear finite elements, and sheets that stretch."""

from __future__ import annotations

import numpy as np
import pytest
from support.full_solution import Full, Reduced, static_path
from support.nonlinear_models import METAL
from support.reduction_examples import EI_Y, slender_beam

from femflex.fem import Member, PointMass, build_structure
from femflex.mesh import rectangle
from femflex.reduction import (
    cantilever_modes,
    reduce_structure,
    with_derivatives,
    with_sheet_bends,
)
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.large_deflection.curvature import held_energy
from femflex.reduction.large_deflection.sheet_bends import changed_by_bending

WIDTH, H = 0.6, 1.5e-3
START, REACH = 0.02, 0.23  # bends of the first and the last state


def sheet(family="plate_bfs", mass=0.0):
    mesh = rectangle(1.0, WIDTH, 10, 6, "quad" if family == "plate_bfs" else "triangle")
    masses = [PointMass("right", mass)] if mass else []
    return build_structure(mesh, [Member("surface", family, H, METAL)], masses)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "mass", "modes", "within"),
    [("plate_bfs", 0.0, 4, 5e-3), ("plate_bfs", 0.0, 8, 7e-3), ("plate_bfs", 0.5, 8, 5e-3), ("plate", 0.0, 4, 5e-3)],
)
def test_a_sheet_bent_by_140_thicknesses_follows_its_full_elements(family, mass, modes, within):
    """Under its weight, at four loads up to a tip deflection of 0.19; without the shape up to 37 % short."""
    structure = sheet(family, mass)
    load = structure.M @ rigid_shapes(structure)[:, 2]
    tip = structure.translation[[3 * structure.mesh.group_points("top_right")[0] + 2]].toarray()[0]
    shapes = cantilever_modes(structure, "left", modes)
    full = Full(structure, shapes.held)
    linear = tip[full.free] @ np.linalg.solve(structure.K[full.free][:, full.free].toarray(), load[full.free])
    factors = np.linspace(0, 0.22 / linear, 31)[1:]
    exact = static_path(full, load[full.free], factors) @ tip[full.free]
    assert exact[-1] > 125 * H
    shapes = with_derivatives(structure, with_sheet_bends(structure, shapes, START, REACH))
    assert shapes.kinds.count("third derivative") == 1
    body = reduce_structure(structure, shapes, strain="condensed")
    assert body.n_modes == modes + 1
    phi = shapes.phi[:, : body.n_modes]
    found = static_path(Reduced(body.strain), phi.T @ load, factors) @ (phi.T @ tip)
    assert np.abs(found / exact - 1).max() < within


@pytest.mark.parametrize("sides", [["left", "right"], ["left", "right", "bottom", "top"]])
def test_plates_held_at_more_than_one_side_stretch_and_keep_their_set(sides):
    structure = sheet()
    shapes = cantilever_modes(structure, sides, 3)
    assert with_sheet_bends(structure, shapes, START, REACH).kinds == shapes.kinds


def test_what_is_added_does_not_stretch():
    structure = sheet()
    shapes = with_sheet_bends(structure, cantilever_modes(structure, "left", 4), START, REACH)
    np.testing.assert_allclose(shapes.phi.T @ (structure.M @ shapes.phi), np.eye(5), atol=1e-9)
    moved = (structure.translation @ shapes.phi[:, -1]).reshape(-1, 3)
    assert np.abs(moved[:, :2]).max() < 1e-6 * np.abs(moved[:, 2]).max()
    assert shapes.omega[-1] < 40 * shapes.omega[0]


def test_the_last_state_before_a_beam_between_walls_stretches_is_the_one_that_is_taken():
    """Amplitudes up to twenty radii of gyration, each less than four times the one before; bends store as r^2 + w^2."""
    structure = slender_beam(n=4, order=3)
    one = cantilever_modes(structure, ["start", "end"], 1).picked([0])
    radius = np.sqrt(EI_Y / 1e6)
    found = changed_by_bending(structure, one, 0.1 * radius, 20 * radius)
    phi = one.phi[:, 0]
    moved = np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max()
    amplitude = float(phi @ (structure.M @ found))
    steps = 0.1 * radius / moved * 200 ** (np.arange(5) / 4)
    last = int(np.argmin(np.abs(steps - amplitude)))
    assert amplitude == pytest.approx(steps[last], rel=1e-6) and 0 < last < 4
    linear = phi @ (structure.K @ phi) / 2

    def stored(q):
        """Over that of bending alone: V = k q^2 / 2 + e q^4 of a shape that is held, which stretches evenly."""
        return 1 + 2 * held_energy(structure, one, one.phi)[2][0] * q**2 / (2 * linear)

    assert stored(steps[last]) < 3.0 < stored(steps[last + 1])
    assert changed_by_bending(structure, one, 10 * radius, 20 * radius) is None
