"""MED, VTK, Exodus, XDMF, universal and Ansys files: written by other programs, or by hand from their manuals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import netcdf_file
from support.mesh_files import dataset, unv_elements, unv_nodes, written_exodus

from femflex.mesh import Mesh, box, line, read_mesh, rectangle, write_mesh
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import sizes
from femflex.warning import PhysicsWarning

h5py = pytest.importorskip("h5py")


STEP = "ENS_MAA/mesh/-0000000000000000001-0000000000000000001"


@pytest.fixture
def med(tmp_path):
    path = tmp_path / "plate.med"
    write_mesh(path, rectangle(2, 1, 2, 1, "quad"))
    return path


def test_med_solids_are_numbered_the_way_of_med(tmp_path):
    """MED's first face, seen from inside the brick, turns clockwise: the mirror image of VTK's."""
    path = tmp_path / "brick.med"
    write_mesh(path, box(1, 1, 1, 1, 1, 1))
    with h5py.File(path) as file:
        points = file[f"{STEP}/NOE/COO"][()].reshape(3, -1).T
        nodes = file[f"{STEP}/MAI/HE8/NOD"][()].reshape(8, -1).T - 1
    a, b, d, e = points[nodes[0]][[0, 1, 3, 4]]
    assert np.dot(np.cross(b - a, d - a), e - a) == pytest.approx(-1)


def vtk_grid():
    """Two quadrilaterals, a line and a point, as VTK's own writer stores them."""
    pyvista = pytest.importorskip("pyvista")
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.0]])
    cells = [4, 0, 1, 4, 3, 4, 1, 2, 5, 4, 2, 0, 3, 1, 5]
    grid = pyvista.UnstructuredGrid(cells, [9, 9, 3, 1], points)
    grid.cell_data["root"] = np.array([0, 0, 1, 0], np.uint8)
    grid.cell_data["tip"] = np.array([0, 0, 0, 1], np.int64)
    grid.cell_data["MaterialIDs"] = np.array([7, 9, 9, 9])
    grid.cell_data["pressure"] = np.array([0.0, 1.0, 0.0, 1.0])
    grid.point_data["hinge"] = np.array([1, 0, 0, 0, 0, 0], np.int32)
    return grid


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
@pytest.mark.parametrize("binary", [True, False])
def test_files_of_vtk_itself_are_read_with_their_markers(suffix, binary, tmp_path):
    path = tmp_path / f"grid{suffix}"
    vtk_grid().save(path, binary=binary)
    mesh = read_mesh(path)
    assert {c: len(n) for c, n in mesh.cells.items()} == {"quad": 2, "line": 1}
    assert sorted(mesh.cell_groups) == ["MaterialIDs_7", "MaterialIDs_9", "root"]
    assert mesh.group_cells("MaterialIDs_7")["quad"].tolist() == [[0, 1, 4, 3]]
    assert mesh.group_points("root").tolist() == [0, 3]
    assert mesh.group_points("hinge").tolist() == [0]
    assert mesh.points[mesh.point_groups["tip"]].tolist() == [[2, 1, 0]]


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
@pytest.mark.parametrize("cell", ["hexahedron27", "quad9", "tetra10", "wedge"])
def test_vtk_itself_reads_what_is_written_here(suffix, cell, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    from femflex.mesh import Mesh

    if cell == "wedge":
        mesh = Mesh(
            [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]], {cell: [range(6)]}, {"a b": {cell: [0]}}
        )
    elif cell == "quad9":
        mesh = rectangle(3, 2, 3, 2, cell).with_groups({"a b": {cell: [0, 1]}})
    else:
        mesh = box(3, 2, 1, 2, 1, 1, cell).with_groups({"a b": {cell: [0, 1]}})
    path = tmp_path / f"mesh{suffix}"
    write_mesh(path, mesh)
    grid = pyvista.read(path)
    name = next(n for n in grid.cell_data if n in ("a b", "a%20b"))
    assert int(np.sum(grid.cell_data[name])) == len(mesh.cell_groups["a b"][cell])
    sizes = grid.compute_cell_sizes()
    total = np.sum(sizes["Volume"]) if mesh.dimension == 3 else np.sum(sizes["Area"][: len(mesh.cells[cell])])
    expected = {"wedge": -0.5}.get(cell, 6)  # VTK's wedge has its first face outward, and VTK counts that as negative
    assert total == pytest.approx(expected, rel=1e-6)


def test_percent_signs_and_blanks_in_names_survive_vtk(tmp_path):
    mesh = line([[0, 0, 0], [1, 0, 0]], 2).with_groups({"left/half %20": {"line": [0]}}, {"50 % span/tip": [1]})
    for suffix in (".vtu", ".vtk"):
        write_mesh(tmp_path / f"mesh{suffix}", mesh)
        back = read_mesh(tmp_path / f"mesh{suffix}")
        assert back.cell_groups["left/half %20"]["line"].tolist() == [0]
        assert back.point_groups["50 % span/tip"].tolist() == [1]


def test_an_exodus_file_of_vtk_is_read_with_its_blocks(tmp_path: Path):
    mesh, path = box(2, 1, 1, 2, 1, 1), tmp_path / "box.exo"
    written_exodus(mesh, path)
    computed = read_mesh(path)
    assert {cell: len(nodes) for cell, nodes in computed.cells.items()} == {"hexahedron": 2, "quad": 10}
    assert sorted(computed.cell_groups) == ["block_12", "block_9"]  # numbered by VTK's types
    assert sizes(computed.points, "hexahedron", computed.cells["hexahedron"]) == pytest.approx([1, 1])
    assert len(computed.points) == 12
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ValueError, match=r"box.exo could not be read as Exodus: its contents are not those of this fo"):
        read_mesh(path)
    with pytest.raises(ValueError, match=r"other.e: Exodus is read only; write other.msh or .vtu instead"):
        write_mesh(tmp_path / "other.e", mesh)


SIDES_OF_BRICK = [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (1, 5, 8, 4), (1, 4, 3, 2), (5, 6, 7, 8)]  # the manual's


@pytest.mark.parametrize("cell", ["hexahedron", "hexahedron20"])
@pytest.mark.parametrize("form", ["classic", "HDF5"])
def test_side_sets_and_node_sets_of_exodus_by_its_manual(cell: str, form: str, tmp_path: Path):
    """Bricks list the middles of upright edges before those of the upper face; sides are numbered from 1."""
    mesh, path = box(2, 1, 1, 2, 1, 1, cell), tmp_path / "bricks.exo"
    bricks = mesh.cells[cell]
    sides = {frozenset(row[[n - 1 for n in side]].tolist()): (k, j) for k, row in enumerate(bricks, 1)
             for j, side in enumerate(SIDES_OF_BRICK, 1)}  # fmt: skip
    pairs = [sides[frozenset(rows[:4].tolist())] for rows in next(iter(mesh.group_cells("right").values()))]
    pairs += [sides[frozenset(rows[:4].tolist())] for rows in next(iter(mesh.group_cells("top").values()))]
    listed = bricks if cell == "hexahedron" else bricks[:, [*range(12), *range(16, 20), *range(12, 16)]]
    arrays = {f"coord{axis}": column for axis, column in zip("xyz", mesh.points.T, strict=True)}
    arrays |= {"connect1": listed.astype("i4") + 1, "eb_prop1": np.array([12], "i4"), "ss_prop1": np.array([5], "i4")}
    arrays |= {"ns_prop1": np.array([7], "i4"), "node_ns1": np.array([1, 4], "i4")}
    arrays |= {name: np.array(column, "i4") for name, column in zip(("elem_ss1", "side_ss1"), zip(*pairs, strict=True),
                                                                    strict=True)}  # fmt: skip
    if form == "HDF5":
        with h5py.File(path, "w") as file:
            for name, values in arrays.items():
                file[name] = values
            file["connect1"].attrs["elem_type"] = "HEX"
            file["eb_names"] = np.array([list("core"[k : k + 1].encode() for k in range(4))], "S1")
    else:
        with netcdf_file(path, "w") as file:
            for name, values in {**arrays, "eb_names": np.array([[b"c", b"o", b"r", b"e"]])}.items():
                sizes_of = [f"{name}_{k}" for k in range(values.ndim)]
                for size_name, size in zip(sizes_of, values.shape, strict=True):
                    file.createDimension(size_name, size)
                file.createVariable(name, values.dtype.char if values.dtype.kind != "S" else "c", sizes_of)[:] = values
            file.variables["connect1"].elem_type = "HEX"
    computed = read_mesh(path)
    assert np.array_equal(computed.points[computed.cells[cell]], mesh.points[bricks])
    assert len(computed.cell_groups["core"][cell]) == 2 and computed.point_groups["nodeset_7"].tolist() == [0, 3]
    expected = np.union1d(mesh.group_points("right"), mesh.group_points("top"))
    assert computed.group_points("sideset_5").tolist() == expected.tolist()
    areas = [sizes(computed.points, c, n).sum() for c, n in computed.group_cells("sideset_5").items()]
    assert sum(areas) == pytest.approx(3.0)


@pytest.mark.parametrize("stored", ["XML", "HDF"])
def test_an_xdmf_file_of_meshio_is_read_with_its_marked_cells(stored: str, tmp_path: Path):
    meshio = pytest.importorskip("meshio")
    mesh, path = rectangle(2, 1, 2, 1, "quad"), tmp_path / "plate.xdmf"
    marks = [np.array([7, 9]), np.array([9] * 6)]
    meshio.xdmf.write(
        path, meshio.Mesh(mesh.points, list(mesh.cells.items()), cell_data={"mat": marks}), data_format=stored
    )
    computed = read_mesh(path)
    assert {cell: len(nodes) for cell, nodes in computed.cells.items()} == {"quad": 2, "line": 6}
    assert computed.group_cells("mat_7")["quad"].tolist() == [mesh.cells["quad"][0].tolist()]
    assert len(computed.group_cells("mat_9")["line"]) == 6
    assert computed.points == pytest.approx(mesh.points)
    path.write_text(path.read_text().replace("Geometry", "Gemetry"))
    with pytest.raises(ValueError, match=r"plate.xdmf could not be read as XDMF"):
        read_mesh(path)


def test_a_universal_file_is_read_with_its_groups(tmp_path: Path):
    """A brick of 20 nodes, a tetrahedron of 10 and a beam of three, in the order of the format: round every face."""
    brick, path = box(1, 1, 1, 1, 1, 1, "hexahedron20"), tmp_path / "parts.unv"
    corner = box(1, 1, 1, 1, 1, 1, "tetra10").translated([3, 0, 0])
    points = np.concatenate([brick.points, corner.points])
    (hexa,), tetra = brick.cells["hexahedron20"], corner.cells["tetra10"][0] + len(brick.points)
    ring = [0, 8, 1, 9, 2, 10, 3, 11, 16, 17, 18, 19, 4, 12, 5, 13, 6, 14, 7, 15]
    cells = [
        (5, 116, 2, (hexa[ring] + 11).tolist()),
        (6, 118, 3, (tetra[[0, 4, 1, 5, 2, 6, 7, 8, 9, 3]] + 11).tolist()),
        (7, 24, 4, [hexa[0] + 11, hexa[8] + 11, hexa[1] + 11]),
        (8, 161, 4, [hexa[0] + 11]),
    ]
    group = [f"{1:10d}" + f"{0:10d}" * 6 + f"{3:10d}", "both solids", "8 5 0 0 8 6 0 0", "8 99 0 0"]
    nodes = [f"{2:10d}" + f"{0:10d}" * 6 + f"{1:10d}", "", f"7 {hexa[0] + 11} 0 0"]
    path.write_text(
        dataset(151, "a model") + dataset(2411, *unv_nodes(points)) + dataset(2412, *unv_elements(cells))
        + dataset(2467, *group, *nodes)
    )  # fmt: skip
    with pytest.warns(PhysicsWarning) as caught:
        mesh = read_mesh(path)
    assert any("left out: element 161 of 1 nodes (1); 3 are kept" in str(warning.message) for warning in caught)
    assert mesh.points[mesh.cells["hexahedron20"][0]] == pytest.approx(brick.points[hexa])
    assert mesh.points[mesh.cells["tetra10"][0]] == pytest.approx(points[tetra])
    assert mesh.points[mesh.cells["line3"][0]] == pytest.approx(brick.points[hexa[[0, 1, 8]]])
    assert sorted(mesh.group_cells("both solids")) == ["hexahedron20", "tetra10"]
    assert list(mesh.group_cells("property_3")) == ["tetra10"]
    assert mesh.points[mesh.group_points("group_2")] == pytest.approx(brick.points[hexa[:1]])


@pytest.mark.parametrize(("cell", "kind"), [("quad8", 95), ("triangle6", 92), ("wedge15", 113), ("pyramid", 312)])
def test_node_order_of_universal_files(tmp_path: Path, cell: str, kind: int):
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
    computed = mesh.points[mesh.cells[cell][0]]
    assert computed[: own.n_corners] == pytest.approx(corners)
    for node, parents in enumerate(own.parents, own.n_corners):
        assert computed[node] == pytest.approx(computed[parents].mean(axis=0))


POINTS = np.array([
    [0, 0, 0], [1.5, 0, 0], [1.5, 1.25, 0], [0, 1.25, 0], [0, 0, 1], [1.5, 0, 1.125], [1.5, 1.25, 1], [0, 1.25, 1],
    [3, 0, 0], [3.25, 1.25, 0.5], [3, 0, 1], [3.25, 1.25, 1.75], [4, 0.5, 0.25],
])  # fmt: skip


CELLS = {
    "hexahedron": [[0, 1, 2, 3, 4, 5, 6, 7]],
    "tetra": [[1, 8, 2, 5], [8, 9, 2, 5], [8, 12, 9, 5]],
    "quad": [[0, 1, 5, 4], [3, 0, 4, 7]],
    "triangle": [[1, 8, 5], [8, 12, 5], [10, 11, 9]],
    "line": [[0, 3], [8, 12], [12, 10], [3, 7]],
}


GROUPS: dict[str, dict[str, list[int]]] = {
    "core": {"hexahedron": [0], "tetra": [1]},
    "core1": {"tetra": [0, 2]},
    "skin": {"quad": [1], "triangle": [0, 1]},
    "skin1": {"quad": [0, 1], "triangle": [2]},
    "seam": {"line": [1, 2]},
    "seam1": {"line": [0, 3]},
}


SPOTS = {"spot": [11], "spot1": [2, 3, 12], "spot11": [3]}


NUMBER = {
    cell: list(range(first, first + len(CELLS[cell]))) for cell, first in zip(CELLS, (40, 20, 60, 50, 10), strict=True)
}  # of elements, where a format has them


MADE = ("block_", "property_", "type_", "mat_", "real_")  # groups that a format gives besides those of the file


def expected_mesh() -> Mesh:
    """The mesh that should be read."""
    return Mesh(POINTS, {cell: np.array(rows) for cell, rows in CELLS.items()}, GROUPS, SPOTS)


def mesh_contents(mesh: Mesh) -> dict[str, Any]:
    """Points, cells, and members of all groups of a mesh, in their order."""
    groups = {name: by for name, by in mesh.cell_groups.items() if not name.startswith(MADE)}
    return {
        "points": mesh.points.round(9).tolist(),
        "cells": {cell: mesh.cells[cell].tolist() for cell in sorted(mesh.cells)},
        "groups": {
            name: {cell: groups[name][cell].tolist() for cell in sorted(groups[name])} for name in sorted(groups)
        },
        "spots": {name: mesh.point_groups[name].tolist() for name in sorted(mesh.point_groups)},
    }


def universal(path: Path) -> None:
    """A universal file: nodes from 11 on, elements by number, groups of nodes and elements."""
    kinds = {"hexahedron": 115, "tetra": 111, "quad": 94, "triangle": 91, "line": 11}
    cells = [
        (number, kinds[cell], 3, [n + 11 for n in nodes])
        for cell in CELLS for number, nodes in zip(NUMBER[cell], CELLS[cell], strict=True)
    ]  # fmt: skip
    members = [(name, [(8, NUMBER[cell][r]) for cell, rows in by.items() for r in rows]) for name, by in GROUPS.items()]
    members += [(name, [(7, row + 11) for row in rows]) for name, rows in SPOTS.items()]
    lines = []
    for k, (name, listed) in enumerate(members, 1):
        lines += [f"{k:10d}" + f"{0:10d}" * 6 + f"{len(listed):10d}", name]
        pairs = [f"{kind:10d}{number:10d}{0:10d}{0:10d}" for kind, number in listed]
        lines += ["".join(pairs[k : k + 2]) for k in range(0, len(pairs), 2)]
    path.write_text(
        dataset(2411, *unv_nodes(POINTS)) + dataset(2412, *unv_elements(cells)) + dataset(2467, *lines)
    )  # fmt: skip


def archive(path: Path) -> None:
    """An Ansys archive: solids, shells and links of three element types, components of elements and nodes."""
    kinds = {"hexahedron": 1, "tetra": 1, "quad": 2, "triangle": 2, "line": 3}
    doubled = {"tetra": [0, 1, 2, 2, 3, 3, 3, 3], "triangle": [0, 1, 2, 2]}
    nodes = [f"{k:8d}{0:8d}{0:8d}" + "".join(f"{x:20.13E}" for x in row) for k, row in enumerate(POINTS, 1)]
    cells = []
    for cell in CELLS:
        for number, listed in zip(NUMBER[cell], CELLS[cell], strict=True):
            corners = [listed[k] + 1 for k in doubled.get(cell, range(len(listed)))]
            head = (1, kinds[cell], 1, 1, 0, 0, 0, 0, len(corners), 0, number)
            cells.append("".join(f"{value:8d}" for value in (*head, *corners)))
    components = []
    members = [
        (name, "ELEM", [NUMBER[cell][r] for cell, rows in by.items() for r in rows]) for name, by in GROUPS.items()
    ]
    members += [(name, "NODE", [row + 1 for row in rows]) for name, rows in SPOTS.items()]
    for name, what, listed in members:
        components += [f"CMBLOCK,{name.upper()},{what},{len(listed)}", "(8i10)"]
        components += ["".join(f"{number:10d}" for number in sorted(listed))]
    path.write_text("\n".join([
        "/PREP7", "ET,1,185", "ET,2,181", "ET,3,180", f"NBLOCK,6,SOLID,{len(nodes)},{len(nodes)}", "(3i8,6e20.13)",
        *nodes, "N,R5.3,LOC,-1,", f"EBLOCK,19,SOLID,{len(cells)},{len(cells)}", "(19i8)", *cells, f"{-1:8d}",
        *components, "FINISH", "",
    ]))  # fmt: skip


BY_HAND = {".unv": universal, ".cdb": archive}


@pytest.mark.parametrize("suffix", BY_HAND)
def test_a_mesh_of_another_program_is_read_in_the_same_order(suffix: str, tmp_path: Path):
    path = tmp_path / f"parts{suffix}"
    BY_HAND[suffix](path)
    expected = mesh_contents(expected_mesh())
    if suffix == ".cdb":  # Ansys has its names in capitals
        expected |= {key: {name.upper(): by for name, by in expected[key].items()} for key in ("groups", "spots")}
    assert mesh_contents(read_mesh(path)) == expected


def test_error_for_file_of_several_meshes(tmp_path):
    write_mesh(tmp_path / "two.med", rectangle(1, 1, 1, 1))
    with h5py.File(tmp_path / "two.med", "r+") as file:
        file.copy("ENS_MAA/mesh", "ENS_MAA/other")
    with pytest.raises(ValueError, match=r"two\.med is a MED file of 2 meshes, mesh, other; .* Export"):
        read_mesh(tmp_path / "two.med")
