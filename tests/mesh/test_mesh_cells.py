"""Shape functions, sizes, qualities and quadrature of cells, and generators of lines, sheets and boxes."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from femflex.mesh import annulus, box, check, line, rectangle
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES
from femflex.mesh.quality import quadrature, qualities, sizes


@pytest.mark.parametrize("name", CELL_TYPES)
def test_shape_functions_and_gradients(name):
    kind = CELL_TYPES[name]
    assert kind.interpolation(kind.nodes) == pytest.approx(np.eye(len(kind.nodes)), abs=1e-12)
    rng = np.random.default_rng(2)
    at = rng.uniform(0.1, 0.3, (5, kind.dimension))
    h = 1e-6
    for axis in range(kind.dimension):
        step = h * np.eye(kind.dimension)[axis]
        slope = (kind.interpolation(at + step) - kind.interpolation(at - step)) / (2 * h)
        assert kind.gradients(at)[..., axis] == pytest.approx(slope, abs=1e-8)


def test_sizes_of_curved_cells():
    arc = line(lambda s: [np.cos(s), np.sin(s), 0], 4, "line3")
    assert sizes(arc.points, "line3", arc.cells["line3"]).sum() == pytest.approx(1, rel=1e-5)  # chords: 3e-3


UNIT = {
    "tetra": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "hexahedron": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    "wedge": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
    "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]],
}


def distorted(shape: str, seed: int = 0, n: int = 3):
    """So many cells of a shape with corners moved at random, turned and shifted, each in its own place."""
    rng = np.random.default_rng(seed)
    unit = np.array(UNIT[shape], float)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    cells = [unit + rng.uniform(-0.12, 0.12, unit.shape) for _ in range(n)]
    points = np.concatenate([(1 + 0.3 * k) * cell @ turn.T + [5 * k, 2, -1] for k, cell in enumerate(cells)])
    return points, np.arange(len(points)).reshape(n, -1)


def flux(points, faces):
    """Volume inside bilinear faces: a third of the flux of x, by Gauss points of each."""
    total = 0.0
    g = (1 + np.array([-1, 1]) / np.sqrt(3)) / 2
    for face in faces:
        p = points[face if len(face) == 4 else [*face, face[-1]]]
        for u in g:
            for v in g:
                N = np.array([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])
                du = np.array([-(1 - v), 1 - v, v, -v])
                dv = np.array([-(1 - u), -u, u, 1 - u])
                total += (N @ p) @ np.cross(du @ p, dv @ p) / 4 / 3
    return total


@pytest.mark.parametrize("shape", UNIT)
@pytest.mark.parametrize("seed", [0, 1])
def test_volumes_of_distorted_solids(shape: str, seed: int):
    points, nodes = distorted(shape, seed)
    computed = sizes(points, shape, nodes)
    assert computed == pytest.approx([flux(points, [row[face] for face in FACES[shape]]) for row in nodes], rel=1e-9)
    assert (computed > 0).all()
    mirror = sizes(points, shape, nodes[:, CELL_TYPES[shape].mirrored])
    assert mirror == pytest.approx(-computed, rel=1e-9)


IDEAL = {
    "triangle": [[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]],
    "quad": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    "tetra": [[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0], [0.5, np.sqrt(1 / 12), np.sqrt(2 / 3)]],
    "hexahedron": UNIT["hexahedron"],
    "wedge": [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (0.5, np.sqrt(0.75)))],
    "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, np.sqrt(0.5)]],
}


@pytest.mark.parametrize("shape", IDEAL)
def test_cell_quality(shape: str):
    """Stretched by s along z or x: d s^(2/d) / (d - 1 + s^2), exactly where the ideal Jacobian is a multiple of one."""
    ideal = np.array(IDEAL[shape], float)
    lengths = [np.linalg.norm(ideal[a] - ideal[b]) for a, b in EDGES[shape]]
    assert lengths == pytest.approx([1.0] * len(lengths))
    row = np.arange(len(ideal))[None]
    assert qualities(ideal, shape, row) == pytest.approx([1.0], rel=1e-9)
    assert qualities(7.3 * ideal @ np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]), shape, row) == pytest.approx([1.0])
    d, s = CELL_TYPES[shape].dimension, 2.5
    stretched = ideal * ([s, 1, 1] if d == 2 else [1, 1, s])
    assert qualities(stretched, shape, row) == pytest.approx([d * s ** (2 / d) / (d - 1 + s * s)], rel=1e-9)


@pytest.mark.parametrize("shape", ["triangle", "wedge", "tetra", "hexahedron"])
def test_quadrature_of_polynomials(shape: str):
    at, weight = quadrature(shape, 4)
    from math import factorial as f

    for a, b, c in ((0, 0, 0), (1, 2, 0), (2, 0, 1), (0, 3, 2), (2, 1, 1)):
        if shape == "triangle":
            exact = f(a) * f(b) / f(a + b + 2)
            computed = weight @ (at[:, 0] ** a * at[:, 1] ** b)
        else:
            computed = weight @ (at[:, 0] ** a * at[:, 1] ** b * at[:, 2] ** c)
            exact = {
                "tetra": f(a) * f(b) * f(c) / f(a + b + c + 3),
                "wedge": f(a) * f(b) / f(a + b + 2) / (c + 1),
                "hexahedron": 1 / ((a + 1) * (b + 1) * (c + 1)),
            }[shape]
        assert computed == pytest.approx(exact, rel=1e-12)


SURFACES = ("triangle", "triangle6", "quad", "quad8", "quad9")


SOLIDS = ("hexahedron", "hexahedron20", "hexahedron27", "tetra", "tetra10")


def total(mesh, cell):
    return sizes(mesh.points, cell, mesh.cells[cell]).sum()


def normals(mesh, cell, rows):
    """Outward normals (times size) of boundary faces from their first three corners."""
    corners = mesh.points[mesh.cells[cell][rows][:, :3]]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


@pytest.mark.parametrize("cell", ["line", "line3"])
def test_straight_line(cell):
    mesh = line([[0, 0, 0], [11, 22, 22]], 20, cell)
    size = sizes(mesh.points, cell, mesh.cells[cell])
    assert size == pytest.approx(np.full(20, 33 / 20), rel=1e-13)
    assert mesh.points[mesh.group_points("start")].tolist() == [[0, 0, 0]]
    assert mesh.points[mesh.group_points("end")].tolist() == [[11, 22, 22]]
    assert len(mesh.group_points("line")) == len(mesh.points)


def test_polyline():
    corners = [[0, 0, 0], [0, 0, 4], [3, 0, 4]]
    mesh = line(corners, 14)
    assert sizes(mesh.points, "line", mesh.cells["line"]) == pytest.approx(np.full(14, 0.5))
    for corner in corners:
        assert np.abs(mesh.points - corner).sum(axis=1).min() == 0


def test_helix():
    def helix(s):  # parameter not proportional to length
        return [np.cos(s**2), np.sin(s**2), 0.5 * s**2]

    mesh = line(helix, 10, "line3")
    angle = np.unwrap(np.arctan2(mesh.points[:, 1], mesh.points[:, 0]))
    ends = np.sort(angle)
    assert np.diff(ends) == pytest.approx(np.full(20, 1 / 20), rel=1e-5)
    assert total(mesh, "line3") == pytest.approx(np.sqrt(1.25), rel=1e-6)
    assert np.linalg.norm(mesh.points[:, :2], axis=1) == pytest.approx(np.ones(21))


@pytest.mark.parametrize("cell", SURFACES)
def test_rectangle(cell):
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
def test_area_of_annulus(cell):
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
def test_volume_and_faces_of_box(cell):
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
def test_faces_of_box_belong_to_solids(cell):
    """Every boundary face has all its nodes in exactly one solid: diagonals and second-order nodes agree."""
    mesh = box(2, 2, 1, 2, 2, 1, cell)
    for name in ("left", "right", "front", "back", "bottom", "top"):
        for faces in mesh.group_cells(name).values():
            for face in faces:
                inside = np.isin(mesh.cells[cell], face).sum(axis=1) == len(face)
                assert inside.sum() == 1


@pytest.mark.parametrize(
    ("cell", "element"),
    [
        ("line", skfem.ElementLineP1), ("line3", skfem.ElementLineP2), ("triangle", skfem.ElementTriP1),
        ("triangle6", skfem.ElementTriP2), ("quad", skfem.ElementQuad1), ("quad8", skfem.ElementQuadS2),
        ("quad9", skfem.ElementQuad2), ("tetra", skfem.ElementTetP1), ("tetra10", skfem.ElementTetP2),
        ("hexahedron", skfem.ElementHex1), ("hexahedron20", skfem.ElementHexS2), ("hexahedron27", skfem.ElementHex2),
        ("wedge", skfem.ElementWedge1),
    ],
)  # fmt: skip
def test_shape_functions_are_those_of_scikit_fem(cell, element):
    kind, other = CELL_TYPES[cell], element()
    at = np.random.default_rng(4).uniform(0.0, 0.3, (7, kind.dimension))
    order = [int(np.abs(other.doflocs - node).sum(axis=1).argmin()) for node in kind.nodes]
    values, gradients = zip(*(other.lbasis(at.T, k) for k in order), strict=True)
    assert kind.interpolation(at) == pytest.approx(np.array(values).T, abs=1e-14)
    assert kind.gradients(at) == pytest.approx(np.moveaxis(gradients, (0, 1), (1, 2)), abs=1e-14)
