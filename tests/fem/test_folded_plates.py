"""Plates that meet in a fold: against solids, frames of beams, each other, and in any position."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from support.plate_models import CELL, METAL, frequencies, plate_structure, random_rotation

from femflex.fem import Member, Support, build_structure
from femflex.mesh import Mesh, box, rectangle

LENGTH, WIDTH = 1.0, 0.25


def bent(angle: float, n: int, family: str, turn: np.ndarray | None = None) -> Mesh:
    """Two strips LENGTH x WIDTH that meet along x at an angle (0: flat); groups "a", "b", "surface", points "root"."""
    flat = rectangle(LENGTH, 2 * WIDTH, 4 * n, 2 * n, CELL[family])
    x, y, _ = (flat.points - [0, WIDTH, 0]).T
    up = y > 1e-12
    points = np.stack([x, np.where(up, y * np.cos(angle), y), np.where(up, y * np.sin(angle), 0.0)], axis=1)
    cells = flat.cells[CELL[family]]
    second = (y[cells].mean(axis=1)) > 0
    groups = {
        "a": {CELL[family]: np.flatnonzero(~second)},
        "b": {CELL[family]: np.flatnonzero(second)},
        "surface": {CELL[family]: np.arange(len(cells))},
    }
    points = points if turn is None else points @ turn.T
    return Mesh(points, {CELL[family]: cells}, groups, {"root": np.flatnonzero(x < 1e-9)})


@pytest.mark.slow
def test_bending_of_angle_section():
    """A cantilever of 27-node hexahedra against plates on the middle planes; the models differ by h / WIDTH, 4 %, of
    how far the corner stiffens the legs, which the first mode, of the whole section, hardly feels."""
    h, n = 0.01, 16
    leg = box(LENGTH, WIDTH, h, n, 6, 1, "hexahedron27").translated([0, h / 2, -h / 2])
    web = box(LENGTH, h, WIDTH, n, 1, 6, "hexahedron27").translated([0, -h / 2, h / 2])
    bar = box(LENGTH, h, h, n, 1, 1, "hexahedron27").translated([0, -h / 2, -h / 2])
    solid = leg.merged(web).merged(bar, tolerance=1e-9)
    structure = build_structure(solid, [Member("volume", "solid", material=METAL)])
    expected = frequencies(structure, structure.clamped_dofs("left"), 4)
    mesh = bent(np.pi / 2, 8, "plate")
    points = mesh.points * [1, (WIDTH + h / 2) / WIDTH, (WIDTH + h / 2) / WIDTH]  # middle planes reach the outer faces
    plates = plate_structure(Mesh(points, dict(mesh.cells), mesh.cell_groups, mesh.point_groups), h)
    computed = frequencies(plates, plates.clamped_dofs("root"), 4)
    assert computed[0] == pytest.approx(expected[0], rel=8e-3)
    assert computed == pytest.approx(expected, rel=2.5e-2)


def folded_strip(along: int, across: int, family: str = "plate_bfs") -> Mesh:
    """A strip 1 x 0.05 with a fold by a right angle across its middle; points "root" and "tip"."""
    flat = rectangle(1.0, 0.05, along, across, CELL[family])
    x, y, _ = flat.points.T
    points = np.stack([np.minimum(x, 0.5), y, np.maximum(x - 0.5, 0.0)], axis=1)
    ends = {"root": np.flatnonzero(x < 1e-9), "tip": np.flatnonzero(x > 1 - 1e-9)}
    return Mesh(points, dict(flat.cells), flat.cell_groups, ends)


@pytest.mark.parametrize(("along", "across"), [(20, 1), (40, 1), (20, 4)])
def test_folded_strip_matches_beam_frame(along, across):
    """Under a force on the tip along its second part EI w = a^3 / 3, across it 4/3 a^3, a the length of a part; less
    what clamp and fold take of the crosswise curvature beside them. With a twist for each plane they open at the fold
    between its nodes, by 6 % here and 26 % in a strip four times as wide."""
    structure = plate_structure(folded_strip(along, across), 2e-3, "plate_bfs")
    free = np.setdiff1d(np.arange(structure.n_dof), structure.clamped_dofs("root"))
    tip = structure.mesh.group_points("tip")
    EI, arm = METAL.E * 0.05 * 2e-3**3 / 12, 0.5
    computed = []
    for axis in (2, 0):
        row = structure.translation[3 * tip + axis].sum(axis=0) / len(tip)
        computed.append(row[free] @ np.linalg.solve(structure.K[free][:, free].toarray(), row[free]))
    exact = np.array([1 / 3, 4 / 3]) * arm**3 / EI
    assert computed == pytest.approx(exact, rel=0.015)


def test_corner_of_three_folds():
    """Three sides of a cube, clamped along the edge of one: at the corner no plate twists, nor is it held otherwise.

    Both approach the common answer, from below and above."""
    computed = []
    for family, n in (("plate", 12), ("plate_bfs", 4), ("plate_bfs", 8)):
        floor = rectangle(1.0, 1.0, n, n, CELL[family])
        mesh = floor
        for turn in (np.roll(np.eye(3), 1, axis=0), np.roll(np.eye(3), 2, axis=0)):
            other = Mesh(floor.points @ turn, dict(floor.cells), floor.cell_groups, {})
            mesh = mesh.merged(other, tolerance=1e-9)
        structure = plate_structure(mesh, 5e-3, family)
        computed.append(frequencies(structure, structure.clamped_dofs("right"), 4))
    triangles, coarse, fine = computed
    off = [np.abs(rectangles / triangles - 1).max() for rectangles in (coarse, fine)]
    assert off[1] < 0.01
    assert off[1] < 0.5 * off[0]


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


QUARTER = np.array([[0, -1.0, 0], [1.0, 0, 0], [0, 0, 1.0]])  # folds along y, across which the axes of planes differ


@pytest.mark.parametrize("angle", [-2.0, 2.0])
@pytest.mark.parametrize("family", CELL)
def test_gutter_frequencies_do_not_depend_on_plane_axes(family, angle):
    computed = []
    for C in (np.eye(3), QUARTER @ random_rotation(5)):
        s = build_structure(gutter(family, angle, C), [Member("surface", family, 0.02, METAL)])
        free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("root"))
        K, M = (A[free][:, free].toarray() for A in (s.K, s.M))
        computed.append(linalg.eigh(K, M, eigvals_only=True, subset_by_index=[0, 20]))
    for other in computed[1:]:
        np.testing.assert_allclose(other, computed[0], rtol=1e-6)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("held", [("z", "ry"), ("rx",), ("x", "rz", "ry"), ("z",)])
@pytest.mark.parametrize("family", CELL)
def test_supported_edge_does_not_depend_on_cell_orientation(family, held):
    flat, computed = rectangle(1.0, 0.7, 2, 3, CELL[family]), []
    for C in (np.eye(3), QUARTER @ random_rotation(6)):
        supports = {"left": Support(held, tuple(map(tuple, C.T))), "top": Support(("z", "rx"), tuple(map(tuple, C.T)))}
        s = build_structure(flat.rotated(C), [Member("surface", family, 0.02, METAL)], supports=supports)
        free = np.setdiff1d(np.arange(s.n_dof), s.constrained_dofs(supports))
        K, M = (A[free][:, free].toarray() for A in (s.K, s.M))
        computed.append(linalg.eigh(K, M, eigvals_only=True))
    for other in computed[1:]:
        np.testing.assert_allclose(other, computed[0], rtol=1e-6, atol=1e-8 * computed[0][-1])
