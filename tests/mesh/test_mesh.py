"""The mesh container: groups, moves, merging, and groups by place."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.mesh import Mesh, box, line, rectangle
from femflex.mesh.regions import with_box, with_whole_groups

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)


def square(**changes):
    given = {"points": SQUARE, "cells": {"triangle": [[0, 1, 2], [0, 2, 3]], "line": [[3, 0]]}} | changes
    return Mesh(**given)


def test_group_points():
    mesh = square(cell_groups={"skin": {"triangle": [1, 0]}, "root": {"line": [0]}}, point_groups={"tip": [2, 1, 2]})
    assert mesh.group_points("tip").tolist() == [1, 2]
    assert mesh.group_points("root").tolist() == [0, 3]
    assert mesh.group_points("skin").tolist() == [0, 1, 2, 3]
    assert mesh.group_cells("skin")["triangle"].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_arrays_are_read_only_copies():
    points = SQUARE.copy()
    mesh = square(points=points)
    points[0] = 9
    assert (mesh.points[0] == 0).all()
    for array in (mesh.points, mesh.cells["triangle"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_translation_and_rotation():
    mesh = line([[0, 0, 0], [2, 0, 0]], 2)
    assert mesh.rotated([0, 0, np.pi / 2]).points[-1] == pytest.approx([0, 2, 0], abs=1e-15)
    assert mesh.rotated([0, 0, np.pi], centre=[1, 0, 0]).points[0] == pytest.approx([2, 0, 0], abs=1e-15)
    assert mesh.translated([1, 2, 3]).points[0] == pytest.approx([1, 2, 3])
    assert mesh.scaled(1e-3).points[-1] == pytest.approx([2e-3, 0, 0])
    rng = np.random.default_rng(1)
    cloud = Mesh(rng.normal(size=(6, 3)), {})
    vector = rng.normal(size=3)
    turned = cloud.rotated(vector)
    assert np.linalg.norm(np.diff(turned.points, axis=0), axis=1) == pytest.approx(
        np.linalg.norm(np.diff(cloud.points, axis=0), axis=1), rel=1e-13
    )
    assert cloud.rotated(vector).rotated(-vector).points == pytest.approx(cloud.points, abs=1e-14)
    assert Mesh([vector], {}).rotated(vector).points[0] == pytest.approx(vector, abs=1e-14)  # the axis stays


def test_merging_of_groups_and_points():
    a = rectangle(1, 1, 2, 2, "quad")
    b = rectangle(1, 1, 2, 2, "quad").translated([1, 0, 1e-7])
    loose = a.merged(b)
    assert len(loose.points) == 18
    assert len(loose.cell_groups["surface"]["quad"]) == 8
    joined = a.merged(b, tolerance=1e-6)
    assert len(joined.points) == 15
    assert len(a.merged(b, tolerance=1e-8).points) == 18
    assert len(np.intersect1d(joined.cells["quad"][:4], joined.cells["quad"][4:])) == 3
    assert len(joined.group_points("left")) == 6  # x = 0 of one, x = 1 of the other
    assert joined.points[joined.group_points("right")][:, 0] == pytest.approx([1, 1, 1, 2, 2, 2])


@pytest.mark.parametrize("seed", range(4))
def test_chains_of_close_points_are_merged(seed):
    """Three chains of links just below the tolerance, points numbered at random; the first of each is kept."""
    rng = np.random.default_rng(seed)
    chain = np.repeat(np.arange(3), (5, 4, 3))
    x = np.concatenate([0.9 * np.arange(n) for n in (5, 4, 3)])
    places = np.column_stack([x, 10.0 * chain, np.zeros(12)])
    order = rng.permutation(12)
    points, chain = places[order], chain[order]
    lines = [[a, b] for a in range(12) for b in range(12) if chain[a] != chain[b]]
    joined = Mesh(points, {"line": lines}, point_groups={"last": [11]}).merged(Mesh(np.zeros((0, 3)), {}), 1.0)
    first = [int(np.flatnonzero(chain == k)[0]) for k in range(3)]
    assert joined.points.tolist() == points[sorted(first)].tolist()
    number = {k: sorted(first).index(first[k]) for k in range(3)}
    assert joined.cells["line"].tolist() == [[number[chain[a]], number[chain[b]]] for a, b in lines]
    assert joined.point_groups["last"].tolist() == [number[chain[11]]]


@pytest.fixture
def mesh():
    """A block with its shell faces, a plate beside it, and a mast of lines; skew places."""
    block = box(3, 2, 1, 3, 2, 1).translated([1.0, -2.0, 0.5])
    plate = rectangle(2, 1, 4, 2, "triangle").translated([6.0, 0.0, 0.3])
    return block.merged(plate).with_groups(points={"corner": [0, 1]})


def test_whole_groups(mesh):
    computed = with_whole_groups(mesh, ["all", "all_surfaces", "all_lines", "corner", "all", "other"])
    assert {n: sorted(by) for n, by in computed.cell_groups.items() if n.startswith("all")} == {
        "all": ["hexahedron"],
        "all_surfaces": ["quad", "triangle"],
        "all_lines": ["line"],
    }
    for kind, rows in computed.cell_groups["all_surfaces"].items():
        assert rows.tolist() == list(range(len(mesh.cells[kind])))
    plate = rectangle(2, 1, 2, 1)
    assert with_whole_groups(plate, ["all"]).cell_groups["all"]["triangle"].tolist() == [0, 1, 2, 3]
    assert with_whole_groups(plate, ["all_solids", "surface"]) is plate
    own = plate.with_groups({"all": {"line": [2]}})
    assert with_whole_groups(own, ["all"]).cell_groups["all"]["line"].tolist() == [2]  # the mesh's own stays


def test_points_and_cells_in_box(mesh):
    low, high = np.array([4.0, 0.0, 0.2]), np.array([2.0, -2.0, 1.5])  # its corners in any order
    computed = with_box(mesh, "end", low, high)
    a, b = np.minimum(low, high), np.maximum(low, high)
    inside = [k for k, p in enumerate(mesh.points) if all(a[i] - 1e-7 <= p[i] <= b[i] + 1e-7 for i in range(3))]
    assert 0 < len(inside) < len(mesh.points) and computed.point_groups["end"].tolist() == inside
    expected = {
        kind: [row for row, nodes in enumerate(table) if set(nodes) <= set(inside)]
        for kind, table in mesh.cells.items()
    }
    assert {k: rows.tolist() for k, rows in computed.cell_groups["end"].items()} == {
        k: v for k, v in expected.items() if v
    }
    assert len(expected["hexahedron"]) == 4
