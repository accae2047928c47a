import numpy as np
import pytest

from femflex.mesh import box, line, read_mesh, rectangle, write_mesh

h5py = pytest.importorskip("h5py")
STEP = "ENS_MAA/mesh/-0000000000000000001-0000000000000000001"


@pytest.fixture
def med(tmp_path):
    path = tmp_path / "plate.med"
    write_mesh(path, rectangle(2, 1, 2, 1, "quad"))
    return path


def test_med_meshes_without_time_steps_are_read_as_those_of_one_step(med):
    before = read_mesh(med)
    with h5py.File(med, "r+") as file:
        for part in ("NOE", "MAI"):
            file.move(f"{STEP}/{part}", f"ENS_MAA/mesh/{part}")
        del file[STEP]
    mesh = read_mesh(med)
    assert np.array_equal(mesh.points, before.points) and mesh.groups == before.groups
    assert np.array_equal(mesh.cells["quad"], before.cells["quad"])


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
