import numpy as np
import pytest

from femflex.mesh import annulus, box, check, line, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import qualities, sizes

SURFACES = ("triangle", "triangle6", "quad", "quad8", "quad9")
SOLIDS = ("hexahedron", "hexahedron20", "hexahedron27", "tetra", "tetra10")


def total(mesh, cell):
    return sizes(mesh.points, cell, mesh.cells[cell]).sum()


def normals(mesh, cell, rows):
    """Outward normals (times size) of boundary faces from their first three corners."""
    corners = mesh.points[mesh.cells[cell][rows][:, :3]]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


@pytest.mark.parametrize("cell", ["line", "line3"])
def test_a_line_along_a_segment_has_equal_cells_and_named_ends(cell):
    mesh = line([[0, 0, 0], [11, 22, 22]], 20, cell)
    size = sizes(mesh.points, cell, mesh.cells[cell])
    assert size == pytest.approx(np.full(20, 33 / 20), rel=1e-13)
    assert mesh.points[mesh.group_points("start")].tolist() == [[0, 0, 0]]
    assert mesh.points[mesh.group_points("end")].tolist() == [[11, 22, 22]]
    assert len(mesh.group_points("line")) == len(mesh.points)


def test_a_polyline_keeps_its_corners_and_shares_cells_by_length():
    corners = [[0, 0, 0], [0, 0, 4], [3, 0, 4]]
    mesh = line(corners, 14)
    assert sizes(mesh.points, "line", mesh.cells["line"]) == pytest.approx(np.full(14, 0.5))
    for corner in corners:
        assert np.abs(mesh.points - corner).sum(axis=1).min() == 0


def test_a_helix_is_cut_into_arcs_of_equal_length():
    def helix(s):  # parameter not proportional to length
        return [np.cos(s**2), np.sin(s**2), 0.5 * s**2]

    mesh = line(helix, 10, "line3")
    angle = np.unwrap(np.arctan2(mesh.points[:, 1], mesh.points[:, 0]))
    ends = np.sort(angle)
    assert np.diff(ends) == pytest.approx(np.full(20, 1 / 20), rel=1e-5)
    assert total(mesh, "line3") == pytest.approx(np.sqrt(1.25), rel=1e-6)
    assert np.linalg.norm(mesh.points[:, :2], axis=1) == pytest.approx(np.ones(21))


@pytest.mark.parametrize("cell", SURFACES)
def test_a_rectangle_has_its_area_edges_and_corners(cell):
    mesh = rectangle(6, 1.5, 5, 3, cell)
    assert total(mesh, cell) == pytest.approx(9, rel=1e-13)
    assert qualities(mesh.points, cell, mesh.cells[cell]).min() > 0
    at = {"left": (0, 0), "right": (0, 6), "bottom": (1, 0), "top": (1, 1.5)}
    for name, (axis, value) in at.items():
        assert mesh.group_points(name).tolist() == np.flatnonzero(mesh.points[:, axis] == value).tolist()
    assert mesh.points[mesh.group_points("top_right")].tolist() == [[6, 1.5, 0]]
    edge = "line3" if CELL_TYPES[cell].order == 2 else "line"
    way = mesh.points[mesh.cells[edge][:, 1]] - mesh.points[mesh.cells[edge][:, 0]]
    inward = np.cross([0, 0, 1], way)
    middle = mesh.points[mesh.cells[edge][:, :2]].mean(axis=1)
    assert (np.einsum("ei,ei->e", inward, [3, 0.75, 0] - middle) > 0).all()  # counterclockwise
    check(mesh)


@pytest.mark.parametrize("cell", SURFACES)
def test_an_annulus_has_the_area_of_its_polygon_or_nearly_of_its_circles(cell):
    n = 12
    mesh = annulus(1, 2, 2, n, cell)
    polygon = 0.5 * n * np.sin(2 * np.pi / n) * 3
    if CELL_TYPES[cell].order == 1:
        assert total(mesh, cell) == pytest.approx(polygon, rel=1e-13)
    else:  # parabolas through three points of an arc of 30 degrees
        assert total(mesh, cell) == pytest.approx(3 * np.pi, rel=2e-4)
    for name, r in (("inner", 1), ("outer", 2)):
        assert np.linalg.norm(mesh.points[mesh.group_points(name)], axis=1) == pytest.approx(r)
        assert len(mesh.group_points(name)) == n * CELL_TYPES[cell].order
    check(mesh)


@pytest.mark.parametrize("cell", SOLIDS)
def test_a_box_has_its_volume_and_six_outward_faces(cell):
    mesh = box(3, 2, 1, 3, 2, 2, cell)
    assert total(mesh, cell) == pytest.approx(6, rel=1e-13)
    assert (sizes(mesh.points, cell, mesh.cells[cell]) > 0).all()
    outward = {"left": (0, -1), "right": (0, 1), "front": (1, -1), "back": (1, 1), "bottom": (2, -1), "top": (2, 1)}
    for name, (axis, sign) in outward.items():
        value = mesh.points[:, axis].max() if sign > 0 else 0.0
        assert mesh.group_points(name).tolist() == np.flatnonzero(mesh.points[:, axis] == value).tolist()
        ((face, rows),) = mesh.cell_groups[name].items()
        direction = normals(mesh, face, rows)
        assert (direction[:, axis] * sign > 0).all()
        assert np.abs(np.delete(direction, axis, axis=1)).max() == 0
    check(mesh)


@pytest.mark.parametrize("cell", SOLIDS)
def test_faces_of_a_box_are_faces_of_its_solids(cell):
    """Every boundary face has all its nodes in exactly one solid: diagonals and second-order nodes agree."""
    mesh = box(2, 2, 1, 2, 2, 1, cell)
    for name in ("left", "right", "front", "back", "bottom", "top"):
        for faces in mesh.group_cells(name).values():
            for face in faces:
                inside = np.isin(mesh.cells[cell], face).sum(axis=1) == len(face)
                assert inside.sum() == 1


def test_vtk_puts_every_node_of_a_27_node_brick_where_we_do():
    """VTK's own shape functions, at our unit-cell position of each node, give that node's place and number."""
    pyvista = pytest.importorskip("pyvista")
    mesh = box(3, 2, 1, 1, 1, 1, "hexahedron27")
    cells = mesh.cells["hexahedron27"]
    grid = pyvista.UnstructuredGrid({29: cells}, mesh.points)
    for parametric, node in zip(CELL_TYPES["hexahedron27"].nodes, mesh.points[cells[0]], strict=True):
        weights = [0.0] * 27
        place = [0.0] * 3
        grid.GetCell(0).EvaluateLocation(_reference(0), list(parametric), place, weights)
        assert place == pytest.approx(node.tolist(), abs=1e-12)
        assert weights == pytest.approx((np.linalg.norm(mesh.points[cells[0]] - node, axis=1) == 0).astype(float))


def _reference(value):
    from vtkmodules.vtkCommonCore import reference

    return reference(value)
