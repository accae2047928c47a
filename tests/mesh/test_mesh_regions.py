"""Groups by place and by number, on meshes of several cell types and more than one group."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.mesh import box, rectangle
from femflex.mesh.regions import with_box, with_whole


@pytest.fixture
def mesh():
    """A block with its shell faces, a plate beside it, and a mast of lines; skew places."""
    block = box(3, 2, 1, 3, 2, 1).moved([1.0, -2.0, 0.5])
    plate = rectangle(2, 1, 4, 2, "triangle").moved([6.0, 0.0, 0.3])
    return block.merged(plate).with_groups(points={"corner": [0, 1]})


def test_whole_groups_hold_all_cells_of_their_dimension(mesh):
    found = with_whole(mesh, ["all", "all_surfaces", "all_lines", "corner", "all", "other"])
    assert {n: sorted(by) for n, by in found.cell_groups.items() if n.startswith("all")} == {
        "all": ["hexahedron"],
        "all_surfaces": ["quad", "triangle"],
        "all_lines": ["line"],
    }
    for kind, rows in found.cell_groups["all_surfaces"].items():
        assert rows.tolist() == list(range(len(mesh.cells[kind])))
    plate = rectangle(2, 1, 2, 1)
    assert with_whole(plate, ["all"]).cell_groups["all"]["triangle"].tolist() == [0, 1, 2, 3]
    assert with_whole(plate, ["all_solids", "surface"]) is plate
    own = plate.with_groups({"all": {"line": [2]}})
    assert with_whole(own, ["all"]).cell_groups["all"]["line"].tolist() == [2]  # the mesh's own stays


def test_a_box_takes_the_points_in_it_and_the_cells_between_them(mesh):
    low, high = np.array([4.0, 0.0, 0.2]), np.array([2.0, -2.0, 1.5])  # its corners in any order
    found = with_box(mesh, "end", low, high)
    a, b = np.minimum(low, high), np.maximum(low, high)
    inside = [k for k, p in enumerate(mesh.points) if all(a[i] - 1e-7 <= p[i] <= b[i] + 1e-7 for i in range(3))]
    assert 0 < len(inside) < len(mesh.points) and found.point_groups["end"].tolist() == inside
    expected = {
        kind: [row for row, nodes in enumerate(table) if set(nodes) <= set(inside)]
        for kind, table in mesh.cells.items()
    }
    assert {k: rows.tolist() for k, rows in found.cell_groups["end"].items()} == {
        k: v for k, v in expected.items() if v
    }
    assert len(expected["hexahedron"]) == 4


def test_a_box_within_a_group_takes_its_points_and_cells_alone(mesh):
    everywhere = ([-9, -9, -9], [9, 9, 9])
    found = with_box(mesh, "part", *everywhere, within="right")
    assert found.point_groups["part"].tolist() == mesh.group_points("right").tolist()
    assert {k: r.tolist() for k, r in found.cell_groups["part"].items()} == {
        k: r.tolist() for k, r in mesh.cell_groups["right"].items()
    }
    half = with_box(mesh, "half", [-9, -1, -9], [9, 9, 9], within="volume")
    assert {k: len(r) for k, r in half.cell_groups["half"].items()} == {"hexahedron": 3}
    of_points = with_box(mesh, "few", *everywhere, within="corner")
    assert of_points.point_groups["few"].tolist() == [0, 1] and "few" not in of_points.cell_groups
    with pytest.raises(
        ValueError,
        match=r"no point of group 'corner' lies in the box of region 'x' from \[6, 0, 0\] to \[9, 9, 9\] m; the mesh "
        r"reaches from \[1.0, -2.0, 0.3\] to \[8.0, 1.0, 1.5\] m",
    ):
        with_box(mesh, "x", [6, 0, 0], [9, 9, 9], within="corner")
    with pytest.raises(ValueError, match=r"no point lies in the box of region 'x' from \[10, 0, 0\]"):
        with_box(mesh, "x", [10, 0, 0], [11, 1, 1])
