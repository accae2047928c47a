"""Plates at folds: twists and sides that two members share, and the picture of planes that meet in one line."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from support.plate_models import METAL, displaced, random_rotation

from femflex.fem import Member, Support, build_structure
from femflex.fem.plate.sides import fold_keys
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


@pytest.mark.parametrize("family", CELL)
def test_a_gutter_that_twists_about_its_length_moves_alike_on_both_sides_of_every_fold(family):
    """Drawn points of both planes at a fold keep together under random motions: folds do not open between nodes."""
    mesh = gutter(family)
    s = build_structure(mesh, [Member("surface", family, 1e-6, METAL)])
    skin = s.skin
    v = np.random.default_rng(1).normal(size=s.n_dof)
    u = (skin.operator @ v).reshape(-1, 3)
    for y, z in ((0.4, 0.0), (0.4 + 0.3 * np.cos(0.9), 0.3 * np.sin(0.9))):
        on = np.flatnonzero(np.linalg.norm(skin.points[:, 1:] - [y, z], axis=1) < 1e-5)
        places, which, count = np.unique(skin.points[on, 0].round(6), return_inverse=True, return_counts=True)
        assert len(places) == 7 and (count == 4).all()  # two faces of two planes, at nodes and middles of sides
        for k in range(len(places)):
            same = u[on[which == k]]
            assert np.abs(same - same.mean(axis=0)).max() < 1e-4


@pytest.mark.parametrize("family", CELL)
def test_the_picture_of_a_gutter_has_the_volume_of_its_strips(family):
    """Every plane is drawn closed, with its own corners at the folds."""
    s, h = build_structure(gutter(family), [Member("surface", family, 0.02, METAL)]), 0.02
    skin = s.skin
    quads = skin.cells.get("quad", np.zeros((0, 4), int))
    parts = [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], skin.cells.get("triangle", np.zeros((0, 3), int))]
    faces = np.concatenate(parts)
    a, b, c = skin.points[faces].swapaxes(0, 1)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6 == pytest.approx(1.5 * 1.2 * h)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(2 * 1.5 * 1.2 + h * 2 * (3 * 1.5 + 1.2))


@pytest.mark.parametrize("family", CELL)
def test_a_side_in_the_picture_bends_by_an_eighth_of_its_turning_ends(family):
    """Ends that turn by opposite angles about the side's normal in the plate lift its middle by angle L / 4."""
    s = build_structure(rectangle(1.2, 0.7, 1, 1, CELL[family]), [Member("surface", family, 0.01, METAL)])
    v = displaced(s, lambda p: 0 * p, lambda p: np.outer(p[:, 0] - 0.6, [0, -1.0, 0]) / 0.6)
    u = (s.skin.operator @ v).reshape(-1, 3)
    middle = np.abs(s.skin.points[:, 0] - 0.6) + np.abs(np.abs(s.skin.points[:, 1] - 0.35) - 0.35) < 1e-9
    assert middle.sum() == 4  # both faces of the two long sides
    # w = x^2 / 2L shifted: w' = -theta_y = (x - L/2) 2/L, so the middle lies L / 4 below the ends
    assert u[middle, 2] == pytest.approx(np.full(4, -1.2 / 4))


def test_folds_are_sides_of_cells_in_different_planes_whatever_their_kind():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0.5, 1], [2, 0, 0], [0, 2, 0.0]])
    mesh = Mesh(points, {"quad": [[0, 1, 2, 3]], "triangle": [[2, 1, 4], [1, 5, 2], [3, 2, 6]], "line": [[0, 1]]}, {})
    assert fold_keys(mesh).tolist() == [1 * 7 + 2]
    flat = Mesh(points, {"quad": [[0, 1, 2, 3]], "triangle": [[1, 5, 2], [2, 3, 6]]}, {})
    assert fold_keys(flat).tolist() == []
