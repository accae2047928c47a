"""Every format gives back what was written: points, cells in node order, and every group, also overlapping ones."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from femflex.mesh import Mesh, box, line, read_mesh, rectangle, write_mesh
from femflex.mesh.cells import CELL_TYPES, FACES
from femflex.mesh.second_order import raise_order

FORMATS = {
    "msh 4.1 binary": (".msh", {"version": "4.1"}),
    "msh 4.1 text": (".msh", {"version": "4.1", "binary": False}),
    "msh 2.2 binary": (".msh", {"version": "2.2"}),
    "msh 2.2 text": (".msh", {"version": "2.2", "binary": False}),
    "vtu": (".vtu", {}),
    "vtu text": (".vtu", {"binary": False}),
    "vtk": (".vtk", {}),
    "vtk text": (".vtk", {"binary": False}),
    "med": (".med", {}),
    "inp": (".inp", {}),
    "bdf": (".bdf", {}),
}
LACKING = {".inp": {"hexahedron27", "wedge18", "pyramid13"}, ".bdf": {"line3", "quad9", "hexahedron27", "wedge18"}}


def pyramids(cell):
    """A box of four bricks, each cut into six pyramids about its centre."""
    whole = box(3, 2, 1, 2, 2, 1, "hexahedron")
    hexes = whole.cells["hexahedron"]
    centre = len(whole.points) + np.arange(len(hexes))
    cells = np.concatenate([np.column_stack([hexes[:, face[::-1]], centre]) for face in FACES["hexahedron"]])
    mesh = Mesh(np.concatenate([whole.points, whole.points[hexes].mean(axis=1)]), {"pyramid": cells})
    return mesh if cell == "pyramid" else raise_order(mesh, {"pyramid": np.arange(len(cells))})


def sample(cell, curved_edges=True):
    """A mesh of the cell type out of all axes, with overlapping groups of odd names and groups of points."""
    kind = CELL_TYPES[cell]
    if kind.dimension == 1:
        mesh = line([[0, 0, 0], [2, 0, 0], [2, 1, 0]], 5, cell)
    elif kind.dimension == 2:
        mesh = rectangle(3, 2, 3, 2, cell)
    elif kind.shape == "wedge":
        mesh = Mesh(kind.nodes, {cell: [np.arange(len(kind.nodes))]}).refined()
    elif kind.shape == "pyramid":
        mesh = pyramids(cell)
    else:
        mesh = box(3, 2, 1, 2, 2, 1, cell)
    if not curved_edges and kind.dimension == 2 and kind.order == 2:
        mesh = Mesh(mesh.points, {cell: mesh.cells[cell]})
    n, n_p = len(mesh.cells[cell]), len(mesh.points)
    cells = {
        "first": {cell: np.arange(n // 2)},
        "second half": {cell: np.arange(n // 3, n)},
        "Flügel-7": {cell: [n - 1]},
    }
    points = {"tip": [n_p - 1], "some points": np.arange(0, n_p, 3), "first": [0, 1]}
    if len(mesh.cells) > 1:
        edges = next(c for c in mesh.cells if c != cell)
        cells["both"] = {edges: mesh.cell_groups["left"][edges], cell: [0]}
    return mesh.with_groups(cells, points).rotated([0.3, -0.5, 0.9]).translated([-1, 2e-7, 30])


def assert_equal_meshes(a, b, tolerance):
    """Assert that two meshes are equal, independent of the numbering of their points and cells."""
    assert len(a.points) == len(b.points)
    distance, number = cKDTree(a.points).query(b.points)
    assert distance.max() <= tolerance
    assert len(np.unique(number)) == len(a.points)
    rows = {name: {tuple(number[nodes]) for nodes in b.cells[name]} for name in b.cells}
    assert rows == {name: {tuple(nodes) for nodes in a.cells[name]} for name in a.cells}
    assert sorted(a.cell_groups) == sorted(b.cell_groups)
    for group in a.cell_groups:
        if not a.cell_groups[group]:
            assert not b.cell_groups[group]
            continue
        theirs, mine = b.group_cells(group), a.group_cells(group)
        assert {c: {tuple(number[n]) for n in rows} for c, rows in theirs.items()} == {
            c: {tuple(n) for n in rows} for c, rows in mine.items()
        }
    assert {g: sorted(number[rows].tolist()) for g, rows in b.point_groups.items()} == {
        g: rows.tolist() for g, rows in a.point_groups.items()
    }


@pytest.mark.sampled(30)
@pytest.mark.parametrize("cell", [cell for cell in CELL_TYPES if cell != "vertex"])
@pytest.mark.parametrize("form", FORMATS)
def test_mesh_round_trip(form, cell, tmp_path):
    suffix, options = FORMATS[form]
    mesh = sample(cell, curved_edges=suffix != ".bdf")  # Nastran has no bar of three nodes
    path = tmp_path / f"mesh{suffix}"
    lacking = sorted(LACKING.get(suffix, set()) & set(mesh.cells))
    if lacking:
        with pytest.raises(ValueError, match=rf"has no element for cells of type \['{lacking[0]}'.*\]; write mesh.msh"):
            write_mesh(path, mesh, **options)
        assert list(tmp_path.iterdir()) == []
        return
    write_mesh(path, mesh, **options)
    # Text is written with 17 digits, Nastran's fields hold 16 columns, VTU text 11 digits.
    assert_equal_meshes(mesh, read_mesh(path), {"bdf": 2e-11, "vtu text": 1e-9}.get(form, 1e-14))


@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".vtk", ".med", ".inp", ".bdf"])
def test_several_cell_types_share_a_file(suffix, tmp_path):
    beam = line([[3, 1, 0], [5, 1, 2]], 4)
    plate = rectangle(3, 2, 3, 2, "quad").merged(
        rectangle(3, 2, 3, 2, "triangle").translated([0, 2, 0]), tolerance=1e-9
    )
    mesh = plate.merged(beam, tolerance=1e-9)
    path = tmp_path / f"craft{suffix}"
    write_mesh(path, mesh)
    assert_equal_meshes(mesh, read_mesh(path), 1e-12)


def test_vertex_cells_become_point_groups(tmp_path):
    mesh = Mesh([[0, 0, 0], [1, 0, 0]], {"line": [[0, 1]], "vertex": [[1]]}, {"tip": {"vertex": [0]}})
    path = tmp_path / "mesh.msh"
    write_mesh(path, mesh)
    read = read_mesh(path)
    assert list(read.cells) == ["line"]
    assert read.points[read.point_groups["tip"]].tolist() == [[1, 0, 0]]


def test_groups_may_be_renamed_while_reading(tmp_path):
    path = tmp_path / "mesh.vtu"
    write_mesh(path, rectangle(1, 1, 1, 1, "quad"))
    mesh = read_mesh(path, groups={"clamp": "left"})
    assert "clamp" in mesh.groups and "left" not in mesh.groups
    with pytest.raises(ValueError, match=r"mesh.vtu has no group 'lift' to be named 'clamp'; it has \['bottom'"):
        read_mesh(path, groups={"clamp": "lift"})
