import numpy as np
import pytest

from femflex.mesh import Mesh, annulus, box, check, line, rectangle
from femflex.mesh.cells import CELL_TYPES, FACES
from femflex.mesh.quality import qualities, sizes
from femflex.mesh.second_order import raise_order

FLAT = {
    "line": line([[0, 0, 0], [1, 2, 2]], 3),
    "line3": line([[0, 0, 0], [1, 2, 2]], 3, "line3"),
    **{cell: rectangle(3, 2, 3, 2, cell) for cell in ("triangle", "triangle6", "quad", "quad8", "quad9")},
    **{
        cell: box(3, 2, 1, 2, 2, 1, cell) for cell in ("tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27")
    },
    **{
        cell: Mesh(CELL_TYPES[cell].nodes, {cell: [np.arange(len(CELL_TYPES[cell].nodes))]})
        for cell in ("wedge", "wedge15", "wedge18")
    },
}


@pytest.mark.parametrize("cell", FLAT)
def test_refined_cells_fill_their_parents(cell):
    mesh, fine = FLAT[cell], FLAT[cell].refined()
    kind = CELL_TYPES[cell]
    before, after = (sizes(m.points, cell, m.cells[cell]) for m in (mesh, fine))
    n = 2**kind.dimension
    assert after.reshape(-1, n).sum(axis=1) == pytest.approx(before, rel=1e-12)  # children follow their parent
    assert after == pytest.approx(np.repeat(before / n, n), rel=1e-12)
    check(fine)  # no coincident or loose points, nothing inside out
    twice = mesh.refined(2)
    corners = kind.n_corners
    middles = CELL_TYPES[kind.corner].interpolation(kind.nodes) @ twice.points[twice.cells[cell][:, :corners]]
    assert middles == pytest.approx(twice.points[twice.cells[cell]], abs=1e-13)  # flat cells stay flat


@pytest.mark.parametrize("cell", ["triangle", "triangle6", "quad", "quad8", "quad9"])
def test_refined_rectangle(cell):
    coarse, fine = rectangle(3, 2, 3, 2, cell).refined(), rectangle(3, 2, 6, 4, cell)
    assert np.unique(coarse.points.round(12), axis=0) == pytest.approx(np.unique(fine.points.round(12), axis=0))
    for group in ("left", "right", "bottom", "top", "top_left"):
        a, b = (np.unique(m.points[m.group_points(group)].round(12), axis=0) for m in (coarse, fine))
        assert a == pytest.approx(b)


def test_refined_box():
    coarse, fine = box(3, 2, 1, 2, 1, 1, "hexahedron27").refined(), box(3, 2, 1, 4, 2, 2, "hexahedron27")
    assert np.unique(coarse.points.round(12), axis=0) == pytest.approx(np.unique(fine.points.round(12), axis=0))
    for group in ("left", "back", "top", "volume"):
        a, b = (np.unique(m.points[m.group_points(group)].round(12), axis=0) for m in (coarse, fine))
        assert a == pytest.approx(b)


def test_curved_cells_keep_their_shape():
    mesh = annulus(1, 2, 1, 6, "quad9")
    area = [sizes(m.points, "quad9", m.cells["quad9"]).sum() for m in (mesh, mesh.refined(), mesh.refined(2))]
    assert area == pytest.approx([area[0]] * 3, rel=1e-12)
    outer = mesh.refined().points[mesh.refined().group_points("outer")]
    assert np.linalg.norm(outer, axis=1) == pytest.approx(2, rel=3e-3)  # quarter points lie on the parabola


def test_quality_of_refined_tetrahedra():
    mesh = box(1, 1, 1, 1, 1, 1, "tetra")
    worst = [qualities(m.points, "tetra", m.cells["tetra"]).min() for m in (mesh, mesh.refined(3))]
    assert worst[1] > 0.9 * worst[0]


@pytest.mark.parametrize("order", [1, 2])
def test_pyramids_divide_into_pyramids_and_tetrahedra(order):
    """Next to a brick, on whose face they share every point; the base and the volume are groups."""
    whole = box(2, 1, 1, 2, 1, 1, "hexahedron")
    kept, cut = whole.cells["hexahedron"]
    points = np.concatenate([whole.points, whole.points[cut].mean(axis=0, keepdims=True)])
    cells = {"hexahedron": [kept], "pyramid": [[*cut[face[::-1]], len(whole.points)] for face in FACES["hexahedron"]]}
    mesh = Mesh(points, cells, {"cut": {"pyramid": np.arange(6)}, "two": {"hexahedron": [0], "pyramid": [4]}})
    if order == 2:
        mesh = raise_order(mesh, {kind: np.arange(len(rows)) for kind, rows in cells.items()})
    seam = np.flatnonzero(points[:, 0] == 1.0)
    fine = mesh.with_groups(points={"seam": seam}).refined()
    kinds = ("hexahedron20", "pyramid13", "tetra10") if order == 2 else ("hexahedron", "pyramid", "tetra")
    assert {kind: len(rows) for kind, rows in fine.cells.items()} == dict(zip(kinds, (8, 36, 24), strict=True))
    check(fine)
    volume = {
        group: sum(sizes(fine.points, kind, rows).sum() for kind, rows in fine.group_cells(group).items())
        for group in ("cut", "two")
    }
    assert volume == pytest.approx({"cut": 1.0, "two": 1.0 + 1 / 6}, rel=1e-12)
    each = [sizes(fine.points, kind, fine.cells[kind]) for kind in kinds[1:]]
    np.testing.assert_allclose(each[0], 1 / 48, rtol=1e-12)
    np.testing.assert_allclose(each[1], 1 / 96, rtol=1e-12)
    x = fine.points[:, 0]
    if order == 1:
        assert sorted(fine.group_points("seam")) == sorted(np.flatnonzero(x == 1.0))
        assert len(fine.points) == 27 + 26 - 9 + 1 + 8  # lattice, shell without the seam, centre, its middles
    twice = fine.refined()
    check(twice)
    assert len(twice.cells[kinds[1]]) == 216 and len(twice.cells[kinds[2]]) == 36 * 4 + 24 * 8


def test_refined_point_groups():
    plain = rectangle(2, 2, 2, 2, "quad").refined()
    left = np.flatnonzero(plain.points[:, 0] == 0)
    far = np.flatnonzero((plain.points[:, 0] == 0) & np.isin(plain.points[:, 1], (0, 1)))
    mesh = plain.with_groups(points={"root": left, "hinges": far, "all": np.arange(len(plain.points))})
    fine = mesh.refined()
    assert fine.group_points("root").tolist() == np.flatnonzero(fine.points[:, 0] == 0).tolist()
    assert fine.group_points("hinges").tolist() == far.tolist()  # two points with one between them
    assert len(fine.group_points("all")) == len(fine.points)


def test_refined_lines_on_curved_edges():
    """Ribs of two lines on each edge of nine-node shells share all points with them, on the curve, however often."""
    flat = rectangle(1.0, 1.0, 2, 2, "quad9")
    x, y, _ = flat.points.T
    points = np.stack([x, y, x * x], axis=1)
    edges = np.array([[c[k], c[4 + k]] for c in flat.cells["quad9"] for k in range(4)])
    ends = np.array([[c[4 + k], c[(k + 1) % 4]] for c in flat.cells["quad9"] for k in range(4)])
    lines = np.unique(np.sort(np.concatenate([edges, ends]), axis=1), axis=0)
    mesh = Mesh(points, {"line": lines, "quad9": flat.cells["quad9"]}, {"ribs": {"line": np.arange(len(lines))}})
    for times in (1, 2):
        fine = mesh.refined(times)
        assert np.isin(fine.group_points("ribs"), fine.cells["quad9"]).all()
        assert len(np.unique(np.round(fine.points, 9), axis=0)) == len(fine.points)
        np.testing.assert_allclose(fine.points[:, 2], fine.points[:, 0] ** 2, atol=1e-12)
