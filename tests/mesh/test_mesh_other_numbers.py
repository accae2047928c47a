"""Universal, Exodus, XDMF, MED and Gmsh files and data sets of VTK: unequal numbers, several blocks, several groups."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from test_mesh_other_formats import dataset, unv_elements, unv_nodes

import femflex.mesh.io_ansys as io_ansys
import femflex.mesh.io_exodus as io_exodus
from femflex.mesh import Mesh, box, describe, read_mesh, rectangle, write_mesh
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.gmsh_entities import entities_of, entities_section, physical_tags, read_entities
from femflex.mesh.io_med import med_order
from femflex.mesh.membership import classes
from femflex.mesh.quality import sizes
from femflex.mesh.vtk_data import CELLS, TYPES, cells_of, leaf_contents, membership
from femflex.warning import PhysicsWarning


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


def test_what_a_universal_file_lacks_is_told(tmp_path: Path):
    path = tmp_path / "x.unv"
    nodes, element = unv_nodes(np.eye(3)), unv_elements([(1, 91, 1, [11, 12, 13])])
    path.write_text(dataset(2411, *nodes) + dataset(2412, "         1        91         1"))
    with pytest.raises(ValueError, match=r"an element has 3 numbers, not 6"):
        read_mesh(path)
    short = [*nodes[:-1], "  1.0D0 2.0D0"]
    path.write_text(dataset(2411, *short) + dataset(2412, *element))
    with pytest.raises(ValueError, match=r"the node of the line '13 +1 +1 +11' has 2 coordinates, not 3"):
        read_mesh(path)
    for factor in ("0.0", "1.0", "1.0D0"):
        path.write_text(
            dataset(164, "1SI: metre", f"{factor} 1.0 1.0", "2") + dataset(2411, *nodes) + dataset(2412, *element)
        )
        read_mesh(path)  # no warning


def leaf(name, points, numbers, kinds, cells):
    """A data set as VTK's reader of Exodus hands it over."""
    return {
        "name": name,
        "points": np.array(points, float),
        "kinds": np.array(kinds),
        "offsets": np.concatenate([[0], np.cumsum([len(c) for c in cells])]).astype(int),
        "nodes": np.array([n for c in cells for n in c]),
        "cell": {},
        "point": {"GlobalNodeId": np.array(numbers)},
        "field": {},
    }


GRID = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.0], [3, 1, 0]])  # numbers 10, 20, ...


def exodus_leaves():
    wing = leaf("Element Blocks/wing ID: 4", GRID[[1, 0, 4, 3]], [20, 10, 50, 40], [9], [[1, 0, 2, 3]])
    rest = leaf(
        "Element Blocks/Unnamed block ID: 7", GRID[[2, 1, 5, 4, 6]], [30, 20, 60, 50, 70], [9, 5, 7],
        [[1, 0, 2, 3], [0, 4, 2], [0, 1, 2, 3, 4]],
    )  # fmt: skip
    side = leaf("Side Sets/Unnamed set ID: 2", GRID[[3, 0, 4]], [40, 10, 50], [3, 3], [[0, 1], [2, 0]])
    other = leaf("Side Sets/top ID: 3", GRID[[4, 3, 5]], [50, 40, 60], [3, 3], [[1, 0], [0, 2]])
    nodes = leaf("Node Sets/Unnamed set ID: 9", GRID[[5, 1]], [60, 20], [1, 1], [[0], [1]])
    part = leaf("Node Sets/tip ID: 1", GRID[[5, 6, 2]], [60, 70, 30], [1], [[1]])
    return [wing, rest, side, other, nodes, part]


def test_blocks_and_sets_of_exodus_share_points_by_number_and_cells_by_nodes(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(io_exodus, "read_leaves", lambda kind, path: exodus_leaves())
    found = io_exodus.read(Path("x.exo"))
    assert found.points.tolist() == GRID.tolist()
    blocks = {block.cell: block for block in found.blocks}
    assert blocks["quad"].nodes.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4]]
    assert {g: rows.tolist() for g, rows in blocks["quad"].groups.items()} == {"wing": [0], "block_7": [1]}
    assert blocks["triangle"].nodes.tolist() == [[2, 6, 5]]
    assert blocks["line"].nodes.tolist() == [[3, 0], [4, 3], [4, 5]]
    assert {g: rows.tolist() for g, rows in blocks["line"].groups.items()} == {"sideset_2": [0, 1], "top": [1, 2]}
    assert {g: sorted(rows.tolist()) for g, rows in found.point_groups.items()} == {"nodeset_9": [1, 5], "tip": [6]}
    assert found.left_out == {"VTK type 7": 1}


def test_edges_of_three_nodes_in_flat_exodus_files_are_lines_and_faces_of_solids_stay(monkeypatch: pytest.MonkeyPatch):
    plate = leaf("Element Blocks/a", GRID[:6], range(1, 7), [22], [[0, 2, 5, 1, 4, 3]])
    edge = leaf("Side Sets/rim", GRID[:3], [1, 2, 3], [5], [[0, 2, 1]])
    solid = leaf("Element Blocks/b", [*GRID[:2], GRID[3], [0, 0, 1]], [1, 2, 4, 9], [10], [[0, 1, 2, 3]])
    monkeypatch.setattr(io_exodus, "read_leaves", lambda kind, path: [plate, edge])
    assert [block.cell for block in io_exodus.read(Path("x.exo")).blocks] == ["triangle6", "line3"]
    monkeypatch.setattr(io_exodus, "read_leaves", lambda kind, path: [solid, edge])
    assert [block.cell for block in io_exodus.read(Path("x.exo")).blocks] == ["tetra", "triangle"]
    nameless = leaf("Element Blocks/a", GRID[:3], [1, 2], [5], [[0, 1, 2]])
    monkeypatch.setattr(io_exodus, "read_leaves", lambda kind, path: [nameless])
    with pytest.raises(ValueError, match="its nodes have no numbers"):
        io_exodus.read(Path("x.exo"))


def test_sets_that_vtk_cannot_read_are_left_out_of_exodus_with_a_warning(monkeypatch: pytest.MonkeyPatch):
    def leaves(kind, path):
        if kind == "exodus":
            raise io_exodus.VtkError("VTK: no")
        assert kind == "exodus blocks"
        return exodus_leaves()[:2]

    monkeypatch.setattr(io_exodus, "read_leaves", leaves)
    with pytest.warns(
        PhysicsWarning, match="x.exo: its side sets and node sets cannot be read by VTK; only its blocks"
    ):
        assert len(io_exodus.read(Path("x.exo")).blocks) == 2


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


def test_pixels_voxels_wedges_and_polylines_of_vtk_are_put_in_order():
    grid = np.array([[x, y, z] for z in (0, 2) for y in (0, 1.5) for x in (0, 1)], float)
    kinds, cells = (
        [8, 11, 13, 4, 4, 3, 42],
        [[0, 1, 2, 3], [*range(8)], [0, 2, 1, 4, 6, 5], [0, 1], [0, 1, 2], [5, 6], [0, 1, 2, 3]],
    )
    given = leaf("", grid, range(8), kinds, cells)
    given["cell"] = {"mark%20a": np.array([1, 0, 1, 1, 0, 0, 1]), "mat": np.array([4, 5, 4, 4, 9, -2, 4], np.int8),
                     "real": np.arange(7.0), "vector": np.ones((7, 3), int), "short": np.array([1, 0])}  # fmt: skip
    given["point"] = {"tip": np.array([0, 0, 1, 0, 0, 0, 0, 1], bool), "short": np.array([1, 0])}
    found = leaf_contents(given)
    blocks = {block.cell: block for block in found.blocks}
    for cell, size in (("quad", 1.5), ("hexahedron", 3.0), ("wedge", 1.5)):
        assert sizes(grid, cell, blocks[cell].nodes) == pytest.approx([size])
    assert blocks["line"].nodes.tolist() == [[0, 1], [5, 6]]
    assert found.left_out == {"VTK type 4": 1, "VTK type 42": 1}
    groups = {
        cell: {g: rows.tolist() for g, rows in block.groups.items() if len(rows)} for cell, block in blocks.items()
    }
    assert groups == {
        "quad": {"mark a": [0], "mat_4": [0]},
        "hexahedron": {"mat_5": [0]},
        "wedge": {"mark a": [0], "mat_4": [0]},
        "line": {"mark a": [0], "mat_4": [0], "mat_-2": [1]},
    }
    assert {g: rows.tolist() for g, rows in found.point_groups.items()} == {"tip": [2, 7]}
    assert all(CELLS[TYPES[cell]] == cell for cell in TYPES) and TYPES["quad"] == 9 and TYPES["hexahedron"] == 12
    bad = {**given, "offsets": given["offsets"][:-1]}
    with pytest.raises(ValueError, match="its 7 cells and their lists of nodes do not agree"):
        cells_of(bad)
    with pytest.raises(ValueError, match="its cells of type triangle have 3 to 4 nodes"):
        leaf_contents(leaf("", grid, range(8), [5, 5], [[0, 1, 2], [0, 1, 2, 3]]))


def test_components_types_materials_and_sections_of_ansys_are_groups(monkeypatch: pytest.MonkeyPatch):
    given = leaf("", GRID, range(7), [9, 9, 5], [[0, 1, 4, 3], [1, 2, 5, 4], [2, 6, 5]])
    given["cell"] = {
        "ansys_etype": np.array([2, 1, 2]),
        "ansys_material_type": np.array([7, 7, 4]),
        "ansys_real_constant": np.array([3, 5, 5]),
        "ansys_elem_num": np.array([0, 1, 1]),
        "WING": np.array([0, 1, 1], np.uint8),
        "weight": np.array([0.0, 1.0, 0.0]),
    }
    given["point"] = {
        "ROOT": np.array([1, 0, 0, 1, 0, 0, 0]),
        "ansys_node_num": np.arange(7),
        "origid": np.ones(7, int),
    }
    monkeypatch.setattr(io_ansys, "find_spec", lambda name: True)
    monkeypatch.setattr(io_ansys, "read_leaves", lambda kind, path: [given] if kind == "ansys" else [])
    found = io_ansys.read(Path("x.cdb"))
    groups: dict[str, list[tuple[str, int]]] = {}
    for block in found.blocks:
        for name, rows in block.groups.items():
            groups.setdefault(name, []).extend((block.cell, int(row)) for row in rows)
    first, second, third = ("quad", 0), ("quad", 1), ("triangle", 0)
    assert {name: sorted(rows) for name, rows in groups.items()} == {
        "type_2": [first, third], "type_1": [second], "mat_7": [first, second], "mat_4": [third],
        "real_3": [first], "real_5": [second, third], "WING": [second, third],
    }  # fmt: skip
    assert {name: rows.tolist() for name, rows in found.point_groups.items()} == {"ROOT": [0, 3]}
    monkeypatch.setattr(io_ansys, "read_leaves", lambda kind, path: [{**given, "kinds": []}])
    with pytest.raises(ValueError, match=r"x.cdb holds no elements \(EBLOCK\) that mapdl-archive understands"):
        io_ansys.read(Path("x.cdb"))


def test_an_array_of_few_whole_numbers_is_groups_and_one_of_many_or_reals_is_none():
    assert {n: g.tolist() for n, g in membership("m", np.array([2, 0, 2, 1])).items()} == {
        "m_0": [False, True, False, False],
        "m_1": [False, False, False, True],
        "m_2": [True, False, True, False],
    }
    assert len(membership("m", np.arange(64))) == 64 and membership("m", np.arange(65)) == {}
    assert {n: g.tolist() for n, g in membership("m", np.array([1, 1])).items()} == {"m": [True, True]}
    assert {n: g.tolist() for n, g in membership("m", np.array([0, 0])).items()} == {"m": [False, False]}
    assert membership("m", np.array([0.0, 1.0])) == {} and membership("m", np.zeros((2, 2), int)) == {}


@pytest.mark.parametrize("cell", ["tetra", "tetra10", "hexahedron20", "wedge15", "pyramid13"])
def test_med_lists_solids_in_the_mirror_of_vtk(cell: str):
    """Taken for VTK's, MED's list of nodes is the cell turned inside out, its middle nodes between their corners."""
    kind = CELL_TYPES[cell]
    pyramid = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.5, 1]])
    corners = pyramid if kind.shape == "pyramid" else kind.nodes[: kind.n_corners]
    points = CELL_TYPES[kind.corner].interpolation(kind.nodes) @ corners
    listed = points[np.argsort(med_order(cell))]
    row = np.arange(len(points))[None]
    assert sizes(listed, cell, row) == pytest.approx(-sizes(points, cell, row)) and sizes(points, cell, row) > 0
    for node, parents in enumerate(kind.parents, kind.n_corners):
        assert listed[node] == pytest.approx(listed[parents].mean(axis=0))


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


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("points", r"it claims 7 points and lists \d+ coordinates; 1 to 3 of each are needed"),
        ("cells", r"it claims 5 cells of type SE2 and lists 12 nodes of them"),
        ("families", r"it lists 3 families of 6 points or cells"),
        ("steps", "its mesh has 2 time steps; one is needed"),
        ("nodes", "its mesh has no nodes of its own"),
    ],
)
def test_med_files_whose_counts_do_not_agree_are_refused(tmp_path: Path, change: str, sentence: str):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "plate.med"
    write_mesh(path, rectangle(2, 1, 2, 1, "quad"))
    with h5py.File(path, "r+") as file:
        whole = file["ENS_MAA/mesh"]
        step = next(iter(whole.values()))
        if change == "points":
            step["NOE/COO"].attrs["NBR"] = 7
        elif change == "cells":
            step["MAI/SE2/NOD"].attrs["NBR"] = 5
        elif change == "families":
            del step["NOE/FAM"]
            step["NOE/FAM"] = [0, 0, 0]
        elif change == "steps":
            whole.create_group("later")
        else:
            del step["NOE/COO"]
    with pytest.raises(ValueError, match=sentence):
        read_mesh(path)
    with pytest.raises(ValueError, match=r"MED group names have at most 80 bytes; shorten \['ä{41}'\]"):
        write_mesh(path, rectangle(1, 1, 1, 1).with_groups(points={"ä" * 41: [0], "b" * 80: [1]}))


@pytest.mark.parametrize("binary", [True, False])
def test_entities_of_gmsh_hold_box_groups_and_numbers(binary: bool):
    mesh = box(2, 1, 1, 2, 1, 1).merged(rectangle(1, 1, 1, 1, "quad").moved([-0.1, 4, 0.3]))
    mesh = mesh.with_groups({"two": {"quad": [0, 10], "hexahedron": [1]}, "gone": {}}, {"p": [3, 5], "q": [5]})
    tags = physical_tags(mesh)
    assert len(set(tags.values())) == len(tags) and min(tags.values()) == 1
    assert {(2, "two"), (3, "two"), (3, "gone"), (0, "p"), (0, "q")} <= set(tags)
    entities = entities_of(mesh, tags)
    section = entities_section(entities, binary)
    body = section.removeprefix(b"$Entities\n").removesuffix(b"$EndEntities\n")
    read = read_entities(body, binary, 8)
    assert read == {(e.dimension, e.number): e.groups for e in entities}
    names = {number: name for (_, name), number in tags.items()}
    for entity in entities:
        if entity.dimension == 0:
            expected = {g for g, rows in mesh.point_groups.items() if entity.nodes[0, 0] in rows}
            assert {names[n] for n in entity.groups} == expected
            continue
        rows = [mesh.cells[entity.cell].tolist().index(row) for row in entity.nodes.tolist()]
        for row in rows:
            assert {names[n] for n in entity.groups} == {
                g for g, by in mesh.cell_groups.items() if row in by.get(entity.cell, ())
            }
        assert np.array_equal(entity.points.min(axis=0), mesh.points[entity.nodes].min(axis=(0, 1)))
        assert np.array_equal(entity.points.max(axis=0), mesh.points[entity.nodes].max(axis=(0, 1)))
    assert sum(len(e.nodes) for e in entities if e.dimension) == sum(map(len, mesh.cells.values()))
    if not binary:
        words = body.split()
        assert [int(w) for w in words[:4]] == [sum(e.dimension == d for e in entities) for d in range(4)]
        assert list(map(float, words[4:8])) == [1, *mesh.points[3]]
    with pytest.raises(ValueError, match=r"group names \['a\"b'\] have a quotation mark or line break"):
        physical_tags(mesh.with_groups(points={'a"b': [0]}))


def test_items_are_sorted_by_all_of_their_groups():
    rng = np.random.default_rng(4)
    groups = {name: np.flatnonzero(rng.random(30) < 0.4) for name in "abc"}
    found = classes(groups, 30)
    assert sorted(k for _, rows in found for k in rows) == list(range(30))
    for names, rows in found:
        for k in rows:
            assert set(names) == {name for name, own in groups.items() if k in own}
    first = [int(rows[0]) for _, rows in found]
    assert first == sorted(first)


def test_a_summary_measures_every_type_and_group_of_a_distorted_mesh():
    points = [[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 3, 0], [6, 0, 0], [0, 0, 2], [9, 9, -1]]
    mesh = Mesh(
        points,
        {"quad": [[0, 1, 2, 3]], "triangle": [[1, 4, 2], [0, 1, 2]], "tetra": [[0, 1, 3, 5]], "vertex": [[4], [6]]},
        {"mix": {"quad": [0], "triangle": [1]}, "tip": {"tetra": [0]}, "none": {}},
        {"tip": [4, 5], "one": [3], "no": []},
    )
    lines = {" ".join(row.split()) for row in describe(mesh).splitlines()}
    assert "points 7" in lines and "extent x 0 .. 9 m y 0 .. 9 m z -1 .. 2 m" in lines
    assert "vertex 2" in lines and any(line.startswith("quad 1 area 8 m^2, each 8 .. 8; quality") for line in lines)
    assert any(line.startswith("triangle 2 area 3 m^2, each 1 .. 2; quality") for line in lines)
    (triangle,) = [line for line in lines if line.startswith("triangle")]

    def corner(a, b, c):  # mean ratio of a triangle
        area = np.linalg.norm(np.cross(b - a, c - a)) / 2
        return 4 * np.sqrt(3) * area / sum(side @ side for side in (b - a, c - b, a - c))

    each = [corner(*np.array(points, float)[row]) for row in ([1, 4, 2], [0, 1, 2])]
    place = np.mean(np.array(points, float)[[[1, 4, 2], [0, 1, 2]][int(np.argmin(each))]], axis=0)
    assert f"quality {np.mean(each):.2f}, worst {min(each):.2f} at ({', '.join(f'{x:.4g}' for x in place)})" in triangle
    assert any(line.startswith("tetra 1 volume 4 m^3, each 4 .. 4") for line in lines)
    assert "mix 1 quad (area 8 m^2), 1 triangle (area 2 m^2), 4 points" in lines
    assert "tip 1 tetra (volume 4 m^3)" in lines and "tip 2 points" in lines and "none empty" in lines
    assert "one 1 point at (0, 3, 0) m" in lines and "no empty" in lines
    loose = Mesh([*points, [1, 1, 1]], {"triangle": [[0, 1, 2]]})
    assert describe(loose).splitlines()[0] == "points  8, 5 of them in no cell"
    assert describe(loose).splitlines().count("  none") == 2 and describe(Mesh(np.zeros((0, 3)), {})) == "points  0"
