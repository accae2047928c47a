"""Sizes, qualities and orders of distorted cells, against the divergence theorem, hulls and definitions."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.mesh import rectangle
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES
from femflex.mesh.quality import quadrature, qualities, sizes
from femflex.mesh.refine import refined_values

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
def test_volumes_of_distorted_solids_are_the_flux_through_their_faces(shape: str, seed: int):
    points, nodes = distorted(shape, seed)
    found = sizes(points, shape, nodes)
    assert found == pytest.approx([flux(points, [row[face] for face in FACES[shape]]) for row in nodes], rel=1e-9)
    assert (found > 0).all()
    mirror = sizes(points, shape, nodes[:, CELL_TYPES[shape].mirrored])
    assert mirror == pytest.approx(-found, rel=1e-9)


@pytest.mark.parametrize("cell", [name for name, kind in CELL_TYPES.items() if kind.dimension])
def test_cells_of_any_order_with_straight_edges_have_the_size_of_their_corners(cell: str):
    kind = CELL_TYPES[cell]
    rng = np.random.default_rng(3)
    corners = np.zeros((2, kind.n_corners, 3))
    for k in range(2):
        unit = np.array(UNIT.get(kind.shape, np.pad(kind.nodes[: kind.n_corners], ((0, 0), (0, 3 - kind.dimension)))))
        corners[k] = (unit + rng.uniform(-0.1, 0.1, unit.shape)) * (1 + k)
    weights = CELL_TYPES[kind.corner].interpolation(kind.nodes)
    points = np.einsum("nc,ecx->enx", weights, corners).reshape(-1, 3)
    nodes = np.arange(len(points)).reshape(2, -1)
    plain = sizes(corners.reshape(-1, 3), kind.corner, np.arange(2 * kind.n_corners).reshape(2, -1))
    if kind.dimension == 2 and kind.shape == "quad":
        assert sizes(points, cell, nodes) == pytest.approx(plain, rel=2e-2)  # of a twisted one: Gauss points
    else:
        assert sizes(points, cell, nodes) == pytest.approx(plain, rel=1e-9)
    assert qualities(points, cell, nodes) == pytest.approx(
        qualities(corners.reshape(-1, 3), kind.corner, np.arange(2 * kind.n_corners).reshape(2, -1)), rel=1e-6
    )


IDEAL = {
    "triangle": [[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]],
    "quad": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    "tetra": [[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0], [0.5, np.sqrt(1 / 12), np.sqrt(2 / 3)]],
    "hexahedron": UNIT["hexahedron"],
    "wedge": [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (0.5, np.sqrt(0.75)))],
    "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, np.sqrt(0.5)]],
}


@pytest.mark.parametrize("shape", IDEAL)
def test_cells_with_equal_edges_have_quality_one_and_stretched_ones_the_mean_ratio(shape: str):
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
def test_quadrature_integrates_polynomials_over_the_unit_cells(shape: str):
    at, weight = quadrature(shape, 4)
    from math import factorial as f

    for a, b, c in ((0, 0, 0), (1, 2, 0), (2, 0, 1), (0, 3, 2), (2, 1, 1)):
        if shape == "triangle":
            exact = f(a) * f(b) / f(a + b + 2)
            found = weight @ (at[:, 0] ** a * at[:, 1] ** b)
        else:
            found = weight @ (at[:, 0] ** a * at[:, 1] ** b * at[:, 2] ** c)
            exact = {
                "tetra": f(a) * f(b) * f(c) / f(a + b + c + 3),
                "wedge": f(a) * f(b) / f(a + b + 2) / (c + 1),
                "hexahedron": 1 / ((a + 1) * (b + 1) * (c + 1)),
            }[shape]
        assert found == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("cell", ["triangle", "quad", "line"])
def test_values_at_corners_of_refined_cells_are_those_of_a_linear_field(cell: str):
    mesh = rectangle(2, 1, 2, 1, "triangle" if cell == "line" else cell)
    field = lambda p: 1 + p @ [0.3, -2.0, 0.7]  # noqa: E731
    fine = mesh.refined()
    corners = mesh.points[mesh.cells[cell]]
    found = refined_values(cell, field(corners))
    assert found == pytest.approx(field(fine.points[fine.cells[cell]]))
    each = np.arange(float(len(corners)))
    assert refined_values(cell, each).tolist() == np.repeat(each, len(found) // len(corners)).tolist()
