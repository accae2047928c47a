"""Plates at folds: twists and sides that two members share, and the picture of planes that meet in one line."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from support.plate_models import METAL, random_rotation

from femflex.fem import Member, Support, build_structure
from femflex.mesh import Mesh, rectangle

CELL = {"plate": "triangle", "plate_bfs": "quad"}


def gutter(family: str, angle=0.9, C=None) -> Mesh:
    """Three strips of unequal width, bent up and then out again, along a fold of unequal cells."""
    flat = rectangle(3.0, 3.0, 3, 3, CELL[family])
    x, s, _ = flat.points.T
    x = np.interp(x, [0, 1, 2, 3], [0, 0.5, 0.8, 1.5])
    s = np.interp(s, [0, 1, 2, 3], [0, 0.4, 0.7, 1.2])
    up = np.clip(s - 0.4, 0, 0.3)
    y = np.minimum(s, 0.4) + up * np.cos(angle) + np.maximum(s - 0.7, 0)
    points = np.stack([x, y, up * np.sin(angle)], axis=1)
    points = points if C is None else points @ C.T
    cells = flat.cells[CELL[family]]
    strip = np.searchsorted([0.4, 0.7], s[cells].mean(axis=1))
    groups = {f"s{k}": {CELL[family]: np.flatnonzero(strip == k)} for k in range(3)}
    groups["surface"] = {CELL[family]: np.arange(len(cells))}
    return Mesh(points, {CELL[family]: cells}, groups, {"root": np.flatnonzero(x < 1e-9)})


@pytest.mark.parametrize("family", CELL)
def test_members_in_any_order_share_what_lies_on_their_common_sides(family):
    """One member, three, and three in another order: the same dofs and the same stiffness in all motions."""
    mesh = gutter(family, C=random_rotation(2))
    one = build_structure(mesh, [Member("surface", family, 0.02, METAL)])
    for order in ("012", "201"):
        other = build_structure(mesh, [Member(f"s{k}", family, 0.02, METAL) for k in order])
        assert other.n_dof == one.n_dof
        a, b = (linalg.eigh(s.K.toarray(), s.M.toarray(), eigvals_only=True) for s in (one, other))
        np.testing.assert_allclose(b, a, rtol=1e-6, atol=1e-9 * a[-1])


QUARTER = np.array([[0, -1.0, 0], [1.0, 0, 0], [0, 0, 1.0]])  # folds along y, across which the axes of planes differ


@pytest.mark.parametrize("angle", [-2.0, 2.0])
@pytest.mark.parametrize("family", CELL)
def test_frequencies_of_a_gutter_do_not_depend_on_the_axes_that_its_planes_take(family, angle):
    found = []
    for C in (np.eye(3), QUARTER, random_rotation(4), QUARTER @ random_rotation(5)):
        s = build_structure(gutter(family, angle, C), [Member("surface", family, 0.02, METAL)])
        free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("root"))
        K, M = (A[free][:, free].toarray() for A in (s.K, s.M))
        found.append(linalg.eigh(K, M, eigvals_only=True, subset_by_index=[0, 20]))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-6)


@pytest.mark.parametrize("held", [("z", "ry"), ("rx",), ("x", "rz", "ry"), ("z",)])
@pytest.mark.parametrize("family", CELL)
def test_supports_of_one_edge_hold_the_same_whichever_side_of_its_cells_it_is(family, held):
    flat, found = rectangle(1.0, 0.7, 2, 3, CELL[family]), []
    for C in (np.eye(3), QUARTER, random_rotation(6), QUARTER @ random_rotation(6)):
        supports = {"left": Support(held, tuple(map(tuple, C.T))), "top": Support(("z", "rx"), tuple(map(tuple, C.T)))}
        s = build_structure(flat.rotated(C), [Member("surface", family, 0.02, METAL)], supports=supports)
        free = np.setdiff1d(np.arange(s.n_dof), s.held_dofs(supports))
        K, M = (A[free][:, free].toarray() for A in (s.K, s.M))
        found.append(linalg.eigh(K, M, eigvals_only=True))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-6, atol=1e-8 * found[0][-1])
