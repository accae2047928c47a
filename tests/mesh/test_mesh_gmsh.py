"""Files Gmsh writes are read with their groups; files written here are read by Gmsh with theirs."""

import signal

import numpy as np
import pytest

from femflex.mesh import Mesh, box, read_mesh, rectangle, write_mesh
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import sizes
from femflex.warning import PhysicsWarning

gmsh = pytest.importorskip("gmsh")

GROUPS = {"body": 3, "root": 2, "tip": 0}


@pytest.fixture(scope="module", autouse=True)
def session():
    gmsh.initialize(interruptible=False)
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # as Python has it; gmsh lets a closed pipe end the process
    gmsh.option.setNumber("General.Terminal", 0)
    yield
    gmsh.finalize()


@pytest.fixture(autouse=True)
def fresh():
    gmsh.clear()
    for option, value in {
        "MshFileVersion": 4.1, "Binary": 0, "SaveAll": 0, "SaveParametric": 0, "SecondOrderIncomplete": 0,
        "SaveGroupsOfNodes": 1, "SaveElementTagType": 2,
    }.items():  # fmt: skip
        gmsh.option.setNumber(f"Mesh.{option}", value)


def block(kind, order, incomplete=0):
    """A 2 x 1 x 1 block of tetrahedra, hexahedra or wedges, tilted; groups body, root (a face), tip (a corner)."""
    model, mesh = gmsh.model, gmsh.model.mesh
    if kind == "wedge":
        model.occ.addRectangle(0, 0, 0, 2, 1)
        model.occ.synchronize()
        mesh.setSize(model.getEntities(0), 0.8)
        model.occ.extrude([(2, 1)], 0, 0, 1, numElements=[2], recombine=True)
    else:
        model.occ.addBox(0, 0, 0, 2, 1, 1)
    model.occ.synchronize()
    if kind != "wedge":
        mesh.setSize(model.getEntities(0), 0.6)
    if kind == "hexahedron":
        for _, curve in model.getEntities(1):
            mesh.setTransfiniteCurve(curve, 3)
        for _, surface in model.getEntities(2):
            mesh.setTransfiniteSurface(surface)
            mesh.setRecombine(2, surface)
        mesh.setTransfiniteVolume(1)
    for number, (name, dim) in enumerate(GROUPS.items()):
        model.addPhysicalGroup(dim, [1], number + 1, name)
    mesh.generate(3)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    mesh.setOrder(order)
    tilt = Mesh(np.eye(3), {}).rotated([0.1, 0.2, 0.3]).points.T  # columns are the turned axes
    mesh.affineTransform(np.column_stack([tilt, [0, 0, 0]]).ravel().tolist())


def gmsh_coordinates(name):
    """Coordinates that Gmsh returns for the nodes of a physical group."""
    tag = next(t for d, t in gmsh.model.getPhysicalGroups(GROUPS[name]) if gmsh.model.getPhysicalName(d, t) == name)
    return gmsh.model.mesh.getNodesForPhysicalGroup(GROUPS[name], tag)[1].reshape(-1, 3)


def sorted_rows(points, digits):
    rounded = np.round(points, digits) + 0.0
    return rounded[np.lexsort(rounded.T)]


def assert_middles(mesh, tolerance):
    """Second-order nodes of a straight mesh lie in the middle of their edges and faces: the node order is ours."""
    for cell, nodes in mesh.cells.items():
        kind = CELL_TYPES[cell]
        corners = mesh.points[nodes[:, : kind.n_corners]]
        expected = CELL_TYPES[kind.corner].interpolation(kind.nodes) @ corners
        assert np.abs(expected - mesh.points[nodes]).max() < tolerance


BLOCKS = [(kind, order, inc) for kind in ("tetra", "hexahedron", "wedge") for order, inc in ((1, 0), (2, 0), (2, 1))]
FILES = {
    "msh": (4.1, 0),
    "msh binary": (4.1, 1),
    "msh2": (2.2, 0),
    "msh2 binary": (2.2, 1),
    "med": (0, 0),
    "inp": (0, 0),
}
# To .bdf and .inp Gmsh writes 27-node bricks and 18-node wedges with nodes missing or as types nobody has.
NOT_IN_ABAQUS = [("hexahedron", 2, 0), ("wedge", 2, 0)]
CASES = [(*block, form) for block in BLOCKS for form in FILES if not (form == "inp" and block in NOT_IN_ABAQUS)]


@pytest.mark.sampled(20)
@pytest.mark.parametrize(("kind", "order", "incomplete", "form"), CASES)
def test_blocks_of_all_types_and_orders_are_read_with_their_groups(kind, order, incomplete, form, tmp_path):
    block(kind, order, incomplete)
    version, binary = FILES[form]
    gmsh.option.setNumber("Mesh.Binary", binary)
    if version:
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
    path = tmp_path / f"block.{form[:3]}"
    gmsh.write(str(path))
    mesh = read_mesh(path)
    assert set(GROUPS) <= set(mesh.groups)
    solid = {"tetra": ("tetra", "tetra10", "tetra10"), "hexahedron": ("hexahedron", "hexahedron27", "hexahedron20"),
             "wedge": ("wedge", "wedge18", "wedge15")}[kind][order - 1 + incomplete]  # fmt: skip
    assert len(mesh.group_cells("body")[solid]) == len(mesh.cells[solid])
    volume = sum(sizes(mesh.points, c, n).sum() for c, n in mesh.cells.items() if CELL_TYPES[c].dimension == 3)
    assert volume == pytest.approx(2, rel=1e-6)  # positive: node order, no mirror; Gmsh computes edges to 1e-8
    assert_middles(mesh, 1e-7)
    for group in GROUPS:
        if form == "inp" and group != "tip":  # given twice, as ELSET and NSET of the same nodes
            assert np.array_equal(mesh.point_groups[group], np.unique(np.concatenate(
                [rows.ravel() for rows in mesh.group_cells(group).values()])))  # fmt: skip
        computed = mesh.points[mesh.group_points(group)]
        assert sorted_rows(computed, 6) == pytest.approx(sorted_rows(gmsh_coordinates(group), 6), abs=2e-6)


@pytest.mark.parametrize(
    ("kind", "order"), [("tetra", 1), ("tetra", 2), ("hexahedron", 1), ("hexahedron", 2), ("wedge", 2)]
)
def test_nastran_decks_of_gmsh_are_read_by_property_id(kind, order, tmp_path):
    block(kind, order, incomplete=1)
    path = tmp_path / "block.bdf"
    gmsh.write(str(path))
    mesh = read_mesh(path, groups={"body": "PID 1", "root": "PID 2"})
    assert mesh.groups == ["body", "root"]
    volume = sum(sizes(mesh.points, c, n).sum() for c, n in mesh.cells.items() if CELL_TYPES[c].dimension == 3)
    assert volume == pytest.approx(2, rel=1e-4)  # five digits in fields of 8 columns
    assert_middles(mesh, 1e-4)
    assert sorted_rows(mesh.points[mesh.group_points("root")], 3).shape == gmsh_coordinates("root").shape


def plate():
    """A rectangle whose groups share cells, names and numbers across dimensions."""
    gmsh.model.occ.addRectangle(0, 0, 0, 2, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setSize(gmsh.model.getEntities(0), 0.5)
    gmsh.model.addPhysicalGroup(2, [1], 7)  # no name
    gmsh.model.addPhysicalGroup(1, [4], 3, "root")
    gmsh.model.addPhysicalGroup(1, [4, 1], 4, "two edges")
    gmsh.model.addPhysicalGroup(0, [1], 3, "corner")
    gmsh.model.addPhysicalGroup(0, [1, 2], 5, "root")
    gmsh.model.mesh.generate(2)


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [0, 1])
def test_groups_with_shared_cells_names_and_numbers(version, binary, tmp_path):
    plate()
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(tmp_path / "plate.msh"))
    mesh = read_mesh(tmp_path / "plate.msh")
    assert sorted(mesh.cell_groups) == ["root", "surface_7", "two edges"]
    assert len(mesh.cells["line"]) == 6  # each edge once, though format 2.2 writes those of two groups twice
    assert len(mesh.group_cells("root")["line"]) == 2
    assert len(mesh.group_cells("two edges")["line"]) == 6
    assert mesh.points[mesh.group_points("corner")].tolist() == [[0, 0, 0]]
    assert sorted(mesh.points[mesh.point_groups["root"]].tolist()) == [[0, 0, 0], [2, 0, 0]]
    with pytest.warns(PhysicsWarning, match="'root' names a group of 2 points and another of cells with 3 points"):
        mesh.group_points("root")


@pytest.mark.parametrize("form", ["msh", "msh binary", "msh2", "msh2 binary", "bdf", "inp", "med", "vtk"])
def test_numbers_with_gaps_and_reversed_groups_are_read(form, tmp_path):
    gmsh.model.add("gaps")
    gmsh.model.addDiscreteEntity(1, 7)
    gmsh.model.mesh.addNodes(1, 7, [5, 1000000, 17], [0, 0, 0, 1, 0, 0, 2, 0, 0])
    gmsh.model.mesh.addElements(1, 7, [1], [[40, 90]], [[5, 1000000, 1000000, 17]])
    gmsh.model.addPhysicalGroup(1, [-7], 3, "turned")
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2 if "2" in form else 4.1)
    gmsh.option.setNumber("Mesh.Binary", "binary" in form)
    path = tmp_path / f"gaps.{form[:3]}"
    gmsh.write(str(path))
    mesh = read_mesh(path)
    ends = np.sort(mesh.points[mesh.cells["line"]][:, :, 0], axis=1)
    assert ends.tolist() == [[0, 1], [1, 2]]
    if "msh" in form or form == "inp":
        assert len(mesh.group_points("turned")) == 3


@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("cell", ["triangle6", "quad9", "hexahedron27", "tetra10"])
def test_gmsh_reads_what_is_written_here(cell, binary, version, tmp_path):
    mesh = rectangle(3, 2, 3, 2, cell) if CELL_TYPES[cell].dimension == 2 else box(3, 2, 1, 2, 2, 1, cell)
    half = np.arange(len(mesh.cells[cell]) // 2)
    mesh = mesh.with_groups({"half of it": {cell: half}}, {"marks": [0, 3]}).rotated([0.1, 0.2, 0.3])
    write_mesh(tmp_path / "mesh.msh", mesh, binary=binary, version=version)
    gmsh.open(str(tmp_path / "mesh.msh"))
    groups = {gmsh.model.getPhysicalName(*tag): tag for tag in gmsh.model.getPhysicalGroups()}
    assert set(groups) == set(mesh.groups)
    for name, tag in groups.items():
        nodes, positions = gmsh.model.mesh.getNodesForPhysicalGroup(*tag)
        mine = mesh.points[mesh.group_points(name)]
        assert sorted_rows(positions.reshape(-1, 3), 12) == pytest.approx(sorted_rows(mine, 12), abs=1e-11)
        assert len(nodes) == len(mine)
    quality = gmsh.model.mesh.getElementQualities(gmsh.model.mesh.getElements(mesh.dimension)[1][0], "minDetJac")
    assert quality.min() > 0
    assert len(gmsh.model.mesh.getNodes()[0]) == len(mesh.points)


@pytest.mark.parametrize("cell", ["tetra10", "hexahedron27", "quad9", "wedge15"])
def test_gmsh_reads_the_med_files_written_here(cell, tmp_path):
    kind = CELL_TYPES[cell]
    if kind.shape == "wedge":
        mesh = Mesh(kind.nodes, {cell: [np.arange(15)]}, {"volume": {cell: [0]}})
    else:
        mesh = rectangle(3, 2, 3, 2, cell) if kind.dimension == 2 else box(3, 2, 1, 2, 2, 1, cell)
    write_mesh(tmp_path / "mesh.med", mesh)
    gmsh.open(str(tmp_path / "mesh.med"))
    names = {gmsh.model.getPhysicalName(*tag) for tag in gmsh.model.getPhysicalGroups()}
    assert set(mesh.cell_groups) <= names
    measure = gmsh.model.mesh.getElementQualities(gmsh.model.mesh.getElements(mesh.dimension)[1][0], "minDetJac")
    assert measure.min() > 0
    assert len(measure) == len(mesh.cells[cell])
