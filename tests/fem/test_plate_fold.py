"""Plates that meet in a fold: against solids, against each other, and their side dofs."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import CELL, METAL, frequencies, plate_structure

from femflex.fem import Member, build_structure
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
def test_triangles_and_rectangles_approach_each_other_on_an_angle_section():
    """Two formulations of one L-shaped cantilever."""
    gaps = []
    for n in (4, 8):
        thin = (
            plate_structure(bent(np.pi / 2, n, f), 2e-3, f, **o)
            for f, o in (("plate", {"element": "dkt"}), ("plate_bfs", {}))
        )
        triangles, rectangles = (frequencies(s, s.clamped_dofs("root"), 4) for s in thin)
        gaps.append(np.abs(triangles / rectangles - 1).max())
    assert gaps[1] < 3e-3
    assert gaps[1] < gaps[0] / 2


def test_an_angle_section_bends_like_a_solid_one():
    """A cantilever of 27-node hexahedra against plates on the middle planes; the models differ by h / WIDTH, 4 %, of
    how far the corner stiffens the legs, which the first mode, of the whole section, hardly feels."""
    h, n = 0.01, 16
    leg = box(LENGTH, WIDTH, h, n, 6, 1, "hexahedron27").moved([0, h / 2, -h / 2])
    web = box(LENGTH, h, WIDTH, n, 1, 6, "hexahedron27").moved([0, -h / 2, h / 2])
    bar = box(LENGTH, h, h, n, 1, 1, "hexahedron27").moved([0, -h / 2, -h / 2])
    solid = leg.merged(web).merged(bar, tolerance=1e-9)
    structure = build_structure(solid, [Member("volume", "solid", material=METAL)])
    expected = frequencies(structure, structure.clamped_dofs("left"), 4)
    mesh = bent(np.pi / 2, 8, "plate")
    points = mesh.points * [1, (WIDTH + h / 2) / WIDTH, (WIDTH + h / 2) / WIDTH]  # middle planes reach the outer faces
    plates = plate_structure(Mesh(points, dict(mesh.cells), mesh.cell_groups, mesh.point_groups), h)
    found = frequencies(plates, plates.clamped_dofs("root"), 4)
    assert found[0] == pytest.approx(expected[0], rel=8e-3)
    assert found == pytest.approx(expected, rel=2.5e-2)


@pytest.mark.parametrize("family", ["plate", "plate_bfs"])
def test_a_fold_that_closes_becomes_a_flat_plate(family):
    found = []
    for angle in (0.0, 1e-3):
        structure = plate_structure(bent(angle, 3, family), 0.01, family)
        found.append(frequencies(structure, structure.clamped_dofs("root"), 5))
    assert found[1] == pytest.approx(found[0], rel=2e-3)


def test_three_plates_may_share_a_side():
    mesh = bent(np.pi / 2, 2, "plate")
    third = Mesh(mesh.points * [1, 1, -1], dict(mesh.cells), {"b": mesh.cell_groups["b"]}, {})
    joined = mesh.merged(third, tolerance=1e-9)
    assert len(joined.cell_groups["b"]["triangle"]) == 2 * len(mesh.cell_groups["b"]["triangle"])
    structure = build_structure(joined, [Member(g, "plate", 0.01, METAL) for g in "ab"])
    K = structure.K.toarray()
    scale = np.sqrt(np.abs(np.diag(K)))
    values = np.linalg.eigvalsh(K / np.outer(scale, scale))
    assert np.abs(values[:6]).max() < 1e-11
    assert values[6] > 1e-8


def folded_strip(along: int, across: int, family: str = "plate_bfs") -> Mesh:
    """A strip 1 x 0.05 with a fold by a right angle across its middle; points "root" and "tip"."""
    flat = rectangle(1.0, 0.05, along, across, CELL[family])
    x, y, _ = flat.points.T
    points = np.stack([np.minimum(x, 0.5), y, np.maximum(x - 0.5, 0.0)], axis=1)
    ends = {"root": np.flatnonzero(x < 1e-9), "tip": np.flatnonzero(x > 1 - 1e-9)}
    return Mesh(points, dict(flat.cells), flat.cell_groups, ends)


@pytest.mark.parametrize(("along", "across"), [(20, 1), (40, 1), (20, 4)])
def test_a_folded_strip_of_rectangles_gives_like_a_frame_of_beams_however_few_lie_side_by_side(along, across):
    """Under a force on the tip along its second part EI w = a^3 / 3, across it 4/3 a^3, a the length of a part; less
    what clamp and fold take of the crosswise curvature beside them. With a twist for each plane they open at the fold
    between its nodes, by 6 % here and 26 % in a strip four times as wide."""
    structure = plate_structure(folded_strip(along, across), 2e-3, "plate_bfs")
    free = np.setdiff1d(np.arange(structure.n_dof), structure.clamped_dofs("root"))
    tip = structure.mesh.group_points("tip")
    EI, arm = METAL.E * 0.05 * 2e-3**3 / 12, 0.5
    found = []
    for axis in (2, 0):
        row = structure.translation[3 * tip + axis].sum(axis=0) / len(tip)
        found.append(row[free] @ np.linalg.solve(structure.K[free][:, free].toarray(), row[free]))
    exact = np.array([1 / 3, 4 / 3]) * arm**3 / EI
    assert found == pytest.approx(exact, rel=0.015)


def test_where_three_folds_meet_rectangles_and_triangles_agree():
    """Three sides of a cube, clamped along the edge of one: at the corner no plate twists, nor is it held otherwise.

    Both approach the common answer, from below and above."""
    found = []
    for family, n in (("plate", 12), ("plate_bfs", 4), ("plate_bfs", 8)):
        floor = rectangle(1.0, 1.0, n, n, CELL[family])
        mesh = floor
        for turn in (np.roll(np.eye(3), 1, axis=0), np.roll(np.eye(3), 2, axis=0)):
            other = Mesh(floor.points @ turn, dict(floor.cells), floor.cell_groups, {})
            mesh = mesh.merged(other, tolerance=1e-9)
        structure = plate_structure(mesh, 5e-3, family)
        found.append(frequencies(structure, structure.clamped_dofs("right"), 4))
    triangles, coarse, fine = found
    off = [np.abs(rectangles / triangles - 1).max() for rectangles in (coarse, fine)]
    assert off[1] < 0.01
    assert off[1] < 0.5 * off[0]
