"""Wide thin sheets bent far: reduced bodies against the full nonlinear finite elements, and sheets that stretch."""

from __future__ import annotations

import numpy as np
import pytest
from full_solution import Full, Reduced, static_path
from nonlinear_models import METAL

from femflex.fem import Member, PointMass, build_structure
from femflex.mesh import rectangle
from femflex.reduction import (
    cantilever_modes,
    reduce_structure,
    with_derivatives,
    with_sheet_bends,
)
from femflex.reduction.boundary.rigid import rigid_shapes

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
