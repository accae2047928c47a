"""Boxes of plates with nonlinear strain lack what their webs turn by; how much is told."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh, splu

from femflex.fem import Material, Member, build_structure
from femflex.mesh import Mesh, rectangle
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.reduction.strain.in_plane_turns import in_plane_parts
from femflex.warning import PhysicsWarning

METAL = Material(70e9, 0.3, 2700.0)
LENGTH, SIDE, WALL = 4.0, 0.1, 0.004


def box_column():
    """A clamped column of square section, of four plates."""
    flat = rectangle(LENGTH, SIDE, 16, 1)
    x, y, _ = flat.points.T
    y, half = y - SIDE / 2, np.full_like(x, SIDE / 2)
    whole = None
    for points in ((x, y, half), (x, y, -half), (x, half, y), (x, -half, y)):
        side = Mesh(
            np.stack(points, axis=1), flat.cells, {g: flat.cell_groups[g] for g in ("surface", "left", "right")}
        )
        whole = side if whole is None else whole.merged(side, tolerance=1e-9)
    return build_structure(whole, [Member("surface", "plate", WALL, METAL)])


def test_the_part_told_is_what_eulers_load_misses():
    """Half of the walls sway in their own planes: with half the geometric stiffness the load comes twice too high."""
    structure = box_column()
    modes = cantilever_modes(structure, "left", 2)
    free = np.setdiff1d(np.arange(structure.n_dof), modes.held)
    nodes = structure.mesh.group_points("right")
    push = -structure.translation[3 * nodes].toarray().mean(axis=0)
    K, x = structure.K[free][:, free].tocsc(), np.zeros(structure.n_dof)
    x[free] = splu(K).solve(push[free])
    Kg = structure.internal_force.geometric_stiffness(x)[free][:, free]
    load = 1 / eigsh(-Kg, 1, K, which="LA", return_eigenvectors=False)[0]
    I = 2 * (SIDE * WALL * (SIDE / 2) ** 2 + WALL * SIDE**3 / 12)
    euler = np.pi**2 * METAL.E * I / 4 / LENGTH**2
    parts = in_plane_parts(structure, modes.phi)
    np.testing.assert_allclose(1 - euler / load, parts, atol=0.03)


def test_a_box_with_nonlinear_strain_is_warned_of_and_a_sheet_is_not():
    structure = box_column()
    modes = with_derivatives(structure, cantilever_modes(structure, "left", 2))
    with pytest.warns(PhysicsWarning, match="turn in their own planes.*Use shells, beams or solids") as caught:
        reduce_structure(structure, modes, strain="nonlinear")
    assert float(re.search(r"geometric stiffness: (\d+)%", str(caught[0].message))[1]) == pytest.approx(50, abs=3)
    sheet = build_structure(rectangle(1.0, 0.5, 4, 3), [Member("surface", "plate", 0.002, METAL)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        modes = with_derivatives(sheet, cantilever_modes(sheet, "left", 2))
        reduce_structure(sheet, modes, strain="nonlinear")
        reduce_structure(structure, cantilever_modes(structure, "left", 2))
