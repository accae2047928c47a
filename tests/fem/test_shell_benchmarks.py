"""Octants and quarters of shells, on planes of symmetry: the obstacle course of MacNeal and Harder (1985)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.plate_models import random_rotation

from femflex.fem import Material, Member, build_structure
from femflex.fem.support import Support, symmetry
from femflex.mesh import Mesh, rectangle


def deflection(mesh: Mesh, h: float, material: Material, supports, loads, C) -> np.ndarray:
    """Displacements (k, 3) of nodes under forces {node: (3,)}, of the mesh turned by C."""
    turned = {group: Support(support.components, np.asarray(support.axes) @ C.T) for group, support in supports.items()}
    member = Member("surface", "plate", h, material)
    structure = build_structure(mesh.rotated(C), [member], supports=turned)
    free = np.setdiff1d(np.arange(structure.n_dof), structure.held_dofs(turned))
    F = np.zeros(3 * len(mesh.points))
    for node, force in loads.items():
        F[3 * node : 3 * node + 3] = C @ force
    x = np.zeros(structure.n_dof)
    x[free] = spsolve(structure.K[free][:, free].tocsc(), (structure.translation.T @ F)[free])
    return (structure.translation @ x).reshape(-1, 3) @ C


@pytest.mark.sampled(1)
@pytest.mark.parametrize("turned", [False, True])
def test_pinched_cylinder_with_end_diaphragms(turned):
    """R = 300, L = 600, h = 3, E = 3e6, nu = 0.3, unit forces: 1.8248e-5 under each. An octant of 30 by 30."""
    flat = rectangle(300.0, np.pi / 2, 30, 30)
    s, a, _ = flat.points.T
    mesh = Mesh(np.stack([s, 300 * np.cos(a), 300 * np.sin(a)], axis=1), flat.cells, flat.cell_groups)
    supports = {
        "left": symmetry([1.0, 0, 0]),
        "right": Support(("y", "z", "rx")),
        "bottom": symmetry([0, 0, 1.0]),
        "top": symmetry([0, 1.0, 0]),
    }
    node = mesh.nearest_point([0, 300, 0])
    C = random_rotation(8) if turned else np.eye(3)
    u = deflection(mesh, 3.0, Material(3e6, 0.3, 1.0), supports, {node: np.array([0, -0.25, 0])}, C)
    assert -u[node, 1] == pytest.approx(1.8248e-5, rel=0.015)


@pytest.mark.slow
def test_hemisphere_with_a_hole_under_radial_pulls():
    """R = 10, hole of 18 degrees, h = 0.04, E = 6.825e7, nu = 0.3, pulls of 2: 0.0924 to 0.0940. 36 by 36 cells."""
    flat = rectangle(np.pi / 2, np.radians(72), 36, 36)
    a, b, _ = flat.points.T
    points = 10 * np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)
    mesh = Mesh(points, flat.cells, flat.cell_groups)
    mesh = mesh.with_groups(points={"held": [mesh.nearest_point([10, 0, 0])]})
    supports = {"left": symmetry([0, 1.0, 0]), "right": symmetry([1.0, 0, 0]), "held": Support(("z",))}
    one, other = (mesh.nearest_point(place) for place in ([10, 0, 0], [0, 10, 0]))
    loads = {one: np.array([1.0, 0, 0]), other: np.array([0, -1.0, 0])}
    u = deflection(mesh, 0.04, Material(6.825e7, 0.3, 1.0), supports, loads, random_rotation(9))
    assert 0.0924 < u[one, 0] < 0.0940
    assert -u[other, 1] == pytest.approx(u[one, 0], rel=1e-6)
