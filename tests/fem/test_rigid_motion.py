"""Rigid motion costs nothing and axes do not matter: every family but solids and shells, which have tests alike."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import random_rotation

from femflex.fem import Material, Member, Structure, build_structure
from femflex.fem.sections import CableSection, FullSection, Rectangle
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh, line, rectangle
from femflex.reduction.boundary.rigid import rigid_shapes

METAL = Material(70e9, 0.3, 2700.0)
COUPLED = (
    np.diag([3e6, 1e6, 1.2e6, 400.0, 900.0, 700.0])
    + np.diag([0, 0, 0, 90.0, 60.0], 1)
    + np.diag([0, 0, 0, 90.0, 60.0], -1)
)
MASS = np.diag([2.0, 2.0, 2.0, 0.02, 0.01, 0.01])
BENT = line([[0, 0, 0], [0.7, 0.2, 0.1], [1.0, 0.9, -0.3]], 3)
FLAT = rectangle(1.0, 0.8, 3, 2, "triangle")
SQUARE = rectangle(1.0, 0.8, 2, 2, "quad")


def along(C: np.ndarray, v: list[float]) -> tuple[float, ...]:
    return tuple(float(x) for x in C @ v)


FAMILIES = {
    "beam of order 3": (BENT, lambda C: Member(
        "line", "beam", Rectangle(0.1, 0.06), METAL, {"orientation": along(C, [0.1, 0.2, 1.0]), "extent": 9.0}
    )),
    "beam of order 5 that shears, off its nodes": (BENT, lambda C: Member(
        "line", "beam", Rectangle(0.1, 0.06), METAL,
        {"orientation": along(C, [0.1, 0.2, 1.0]), "order": 5, "shear": True, "offset": (0.02, -0.05),
         "shear_centre": (0.01, 0.0), "mass_centre": (0.0, 0.01)},
    )),
    "beam of coupled stiffness": (BENT, lambda C: Member(
        "line", "beam", FullSection(COUPLED, MASS), None, {"orientation": along(C, [0.1, 0.2, 1.0])}
    )),
    "rod": (BENT, lambda C: Member("line", "rod", CableSection(1e6, 0.3))),
    "tether of order 3": (BENT, lambda C: Member("line", "tether", CableSection(1e6, 0.3), None, {"order": 3})),
    "plate dkt": (FLAT, lambda C: Member("surface", "plate", isotropic(0.01, METAL), None, {"element": "dkt"})),
    "plate dkmt": (FLAT, lambda C: Member("surface", "plate", isotropic(0.1, METAL), None, {"element": "dkmt"})),
    "plate of rectangles": (SQUARE, lambda C: Member("surface", "plate_bfs", isotropic(0.01, METAL))),
    "membrane": (FLAT, lambda C: Member("surface", "membrane", isotropic(0.001, METAL))),
}  # fmt: skip


def warped(mesh: Mesh, name: str) -> Mesh:
    """The mesh, triangles of plates shaken in their plane."""
    if mesh is not FLAT:
        return mesh
    inner = (np.abs(mesh.points[:, 0] - 0.5) < 0.49) & (np.abs(mesh.points[:, 1] - 0.4) < 0.39)
    shift = np.random.default_rng(3).uniform(-0.1, 0.1, mesh.points.shape) * [1, 1, 0]
    return Mesh(mesh.points + inner[:, None] * shift, mesh.cells, mesh.cell_groups, mesh.point_groups)


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_rigid_motion_costs_nothing_and_axes_do_not_matter(name):
    mesh, member = FAMILIES[name]
    mesh, C = warped(mesh, name), random_rotation(5)
    both: list[Structure] = [
        build_structure(mesh, [member(np.eye(3))]),
        build_structure(mesh.rotated(C).moved([30.0, -20.0, 10.0]), [member(C)]),
    ]
    for s in both:
        R = rigid_shapes(s, about=s.mesh.points.mean(axis=0))
        assert R.shape[1] == 6
        assert np.abs(s.K @ R).max() < 1e-10 * abs(s.K).max() * np.abs(R).max()
    for A, B in ((both[0].K, both[1].K), (both[0].M, both[1].M)):
        a, b = (np.linalg.eigvalsh(x.toarray()) for x in (A, B))
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10 * a[-1])
