"""Universal, Exodus, XDMF, MED and Gmsh files and data sets of VTK: unequal numbers, several blocks, several groups."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from test_mesh_other_formats import dataset, unv_elements, unv_nodes

from femflex.mesh import read_mesh, rectangle, write_mesh
from femflex.mesh.cells import CELL_TYPES


def test_elder_datasets_of_a_universal_file_are_read(tmp_path: Path):
    """Nodes of 15 (a line each), elements of 780 (material before property), groups of 2417 (four to a line)."""
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 3], [2, 0, 3], [0, 1, 3]], float)
    nodes = [f"{k + 4:10d}{1:10d}{1:10d}{11:10d}" + "".join(f"{x:13.5E}" for x in p) for k, p in enumerate(points)]
    elements = []
    for number, kind, prop, listed in (
        (31, 94, 6, [4, 5, 6, 7]), (32, 21, 7, [4, 8]), (33, 112, 6, [4, 5, 7, 8, 9, 10]), (34, 111, 8, [4, 5, 7, 8]),
        (35, 22, 7, [5, 9]),
    ):  # fmt: skip
        elements.append("".join(f"{v:10d}" for v in (number, kind, 1, prop, 2, 7, len(listed))))
        elements += ["         0         1         1"] if kind in (21, 22) else []
        elements.append("".join(f"{n:10d}" for n in listed))
    groups = ["         3" + "         0" * 4 + "         6", "  mixed   set ", "8 33 8 31 7 9 7 5", "8 34 8 99"]
    groups += ["         5" + "         0" * 4 + "         1", "", "8 32"]
    path = tmp_path / "old.unv"
    path.write_text(dataset(15, *nodes) + dataset(780, *elements) + dataset(2417, *groups))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = read_mesh(path)
    assert {kind: len(rows) for kind, rows in mesh.cells.items()} == {"quad": 1, "line": 2, "wedge": 1, "tetra": 1}
    assert mesh.points.tolist() == points.tolist()
    assert mesh.cells["wedge"].tolist() == [[0, 1, 3, 4, 5, 6]] and mesh.cells["line"].tolist() == [[0, 4], [1, 5]]
    assert {kind: len(rows) for kind, rows in mesh.cell_groups["property_6"].items()} == {"quad": 1, "wedge": 1}
    assert mesh.group_cells("property_7")["line"].tolist() == [[0, 4], [1, 5]]
    assert sorted(mesh.cell_groups["mixed set"]) == ["quad", "tetra", "wedge"]
    assert mesh.point_groups["mixed set"].tolist() == [1, 5]
    assert mesh.group_cells("group_5")["line"].tolist() == [[0, 4]]


@pytest.mark.parametrize(("cell", "kind"), [("quad8", 95), ("triangle6", 92), ("wedge15", 113), ("pyramid", 312)])
def test_elements_of_a_universal_file_go_round_their_faces(tmp_path: Path, cell: str, kind: int):
    """Corner, middle, corner round the lower face, then upright middles, then the upper face."""
    own = CELL_TYPES[cell]
    unit = {"pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]]}.get(
        cell, np.pad(own.nodes[: own.n_corners], ((0, 0), (0, 3 - own.dimension)))
    )
    corners = np.array(unit) + np.random.default_rng(2).uniform(-0.1, 0.1, (own.n_corners, 3))
    middle = lambda a, b: (corners[a] + corners[b]) / 2  # noqa: E731
    if cell == "pyramid":
        rows = list(corners)
    else:
        base = 3 if own.shape in ("triangle", "wedge") else 4
        ring = lambda s: [x for k in range(base) for x in (corners[s + k], middle(s + k, s + (k + 1) % base))]  # noqa: E731
        rows = ring(0)
        if cell == "wedge15":
            rows = [*rows, *(middle(k, k + 3) for k in range(3)), *ring(3)]
    path = tmp_path / "one.unv"
    listed = [11 + k for k in range(len(rows))]
    path.write_text(dataset(2411, *unv_nodes(np.array(rows))) + dataset(2412, *unv_elements([(1, kind, 2, listed)])))
    mesh = read_mesh(path)
    found = mesh.points[mesh.cells[cell][0]]
    assert found[: own.n_corners] == pytest.approx(corners)
    for node, parents in enumerate(own.parents, own.n_corners):
        assert found[node] == pytest.approx(found[parents].mean(axis=0))


GRID = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.0], [3, 1, 0]])  # numbers 10, 20, ...


def xdmf_grid(name, points, rows, marks, hinge, kind="Quadrilateral"):
    text = lambda table: " ".join(map(str, np.ravel(table)))  # noqa: E731
    return f"""<Grid Name="{name}"><Topology TopologyType="{kind}" NumberOfElements="{len(rows)}">
<DataItem Dimensions="{len(rows)} {len(rows[0])}" NumberType="Int" Format="XML">{text(rows)}</DataItem></Topology>
<Geometry GeometryType="XYZ"><DataItem Dimensions="{len(points)} 3" NumberType="Float" Precision="8" Format="XML">
{text(points)}</DataItem></Geometry>
<Attribute Name="mat" AttributeType="Scalar" Center="Cell"><DataItem Dimensions="{len(rows)}" NumberType="Int"
 Format="XML">{text(marks)}</DataItem></Attribute>
<Attribute Name="hinge" AttributeType="Scalar" Center="Node"><DataItem Dimensions="{len(points)}" NumberType="Int"
 Format="XML">{text(hinge)}</DataItem></Attribute></Grid>"""


def test_grids_of_an_xdmf_file_are_joined_at_points_in_one_place(tmp_path: Path):
    left = xdmf_grid("a", GRID[[4, 0, 1, 3]], [[1, 2, 0, 3]], [7], [1, 1, 0, 0])
    right = xdmf_grid("b", GRID[[2, 5, 1, 4]], [[2, 0, 1, 3]], [7], [0, 1, 0, 0])
    path = tmp_path / "two.xdmf"
    path.write_text(
        f'<?xml version="1.0"?><Xdmf Version="2.0"><Domain><Grid Name="c" GridType="Collection" '
        f'CollectionType="Spatial">{left}{right}</Grid></Domain></Xdmf>'
    )
    mesh = read_mesh(path)
    assert len(mesh.points) == 6
    found = {tuple(map(tuple, mesh.points[row])) for row in mesh.cells["quad"]}
    assert found == {tuple(map(tuple, GRID[row])) for row in ([0, 1, 4, 3], [1, 2, 5, 4])}
    assert mesh.cell_groups["mat_7"]["quad"].tolist() == [0, 1]
    hinge = mesh.points[mesh.point_groups["hinge"]]
    assert sorted(hinge.tolist()) == sorted(GRID[[0, 4, 5]].tolist())  # of both grids


def test_med_families_give_overlapping_groups_points_and_triangles_of_seven_nodes(tmp_path: Path):
    h5py = pytest.importorskip("h5py")
    mesh = rectangle(2, 1, 2, 1, "triangle6").with_groups(
        {"a": {"triangle6": [0, 1, 2], "line3": [1]}, "b": {"triangle6": [2, 3]}}, {"p": [0, 4], "q": [4, 5, 7]}
    )
    path = tmp_path / "plate.med"
    write_mesh(path, mesh)
    with h5py.File(path, "r+") as file:
        step = next(iter(file["ENS_MAA/mesh"].values()))
        own = step["MAI/TR6"]
        listed = own["NOD"][()].reshape(6, -1)
        step.copy("MAI/TR6", step["MAI"], name="TR7")
        del step["MAI/TR6"], step["MAI/TR7/NOD"]
        step["MAI/TR7"].create_dataset("NOD", data=np.concatenate([listed, listed[:1]]).ravel()).attrs["NBR"] = 4
        points = step["MAI"].create_group("PO1")
        points.create_dataset("NOD", data=[9, 3]).attrs["NBR"] = 2
        points["FAM"] = [
            0,
            next(int(f.attrs["NUM"]) for f in file["FAS/mesh/ELEME"].values() if len(f["GRO/NOM"]) == 2),
        ]
    back = read_mesh(path)
    assert back.cells["triangle6"].tolist() == mesh.cells["triangle6"].tolist()
    for group in ("a", "b"):
        assert {k: r.tolist() for k, r in back.cell_groups[group].items()} == {
            k: r.tolist() for k, r in mesh.cell_groups[group].items()
        }
    assert back.point_groups["p"].tolist() == [0, 4] and back.point_groups["q"].tolist() == [4, 5, 7]
    point = [name for name in back.point_groups if name not in mesh.point_groups]
    assert sorted(point) and all(back.point_groups[name].tolist() == [2] for name in point)
