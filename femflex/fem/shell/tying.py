"""Points at which shells sample their covariant strains, and the interpolation from there.

Sampled at points of lower order, in-layer and transverse shear strains can all vanish in pure bending, so that thin
shells do not lock ("mixed interpolation of tensorial components"): E. Dvorkin and K. J. Bathe, Engng Comput. 1 (1984)
77 (four nodes); M. L. Bucalem and K. J. Bathe, Int. J. Num. Meth. Engng 36 (1993) 3729 (nine nodes); P. S. Lee and
K. J. Bathe, Computers & Structures 82 (2004) 945 (triangles of three and six nodes). Here the unit cell is [0, 1]^2, or
the unit triangle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from femflex.arrays import Array
from femflex.mesh.cells import CELL_TYPES

LOW, HIGH = 0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3)  # two Gauss points on a side
THREE = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
TWO = np.array([LOW, HIGH])


@dataclass(frozen=True, eq=False)
class Tying:
    """Assumed components at points (q, 2): weights(points) (q, c, t, c) over the components at the tying points.

    points (t, 2); components rr, ss, 2 rs (in-layer), or rt, st (transverse shear)
    """

    points: Array
    weights: Callable[[Array], Array]


@cache
def inlayer(cell: str) -> Tying | None:
    """Tying of the in-layer strains; None if these are used at the points themselves."""
    if cell == "quad9":
        return _tensor([(0, TWO, THREE), (1, THREE, TWO), (2, TWO, TWO)], 3)
    return _six_inlayer() if cell == "triangle6" else None


@cache
def shear(cell: str) -> Tying:
    """Tying of the transverse shear strains."""
    if cell == "quad9":
        return _tensor([(0, TWO, THREE), (1, THREE, TWO)], 2)
    if cell == "quad":
        middle, ends = np.array([0.5]), np.array([0.0, 1.0])
        return _tensor([(0, middle, ends), (1, ends, middle)], 2)
    return _three_shear() if cell == "triangle" else _six_shear()


@dataclass(frozen=True, eq=False)
class Products:
    """Constants (q, c, k, k) [1] of a cell type at points (q, 2), tied where the cell needs it.

    Covariant strains are their sums over the nodes x_m or directors V_m:

    inlayer  rr, ss, 2 rs: h_k,b h_m,a + h_k,a h_m,b;  untied  the same where it is taken at the points themselves
    slope    rt, st: h_k,a h_m;  turn  h_k h_m,a
    """

    inlayer: Array
    untied: Array
    slope: Array
    turn: Array


def products(cell: str, points: Array) -> Products:
    """The constants of a cell type at points (q, 2), natural coordinates [1], computed once for each set of points."""
    return _products(cell, np.ascontiguousarray(points, float).tobytes())


@cache
def _products(cell: str, raw: bytes) -> Products:
    points = np.frombuffer(raw).reshape(-1, 2)
    untied, inlayer_tying, shear_tying = _inlayer_products(cell, points), inlayer(cell), shear(cell)
    tied = (
        untied
        if inlayer_tying is None
        else _apply_weights(inlayer_tying.weights(points), _inlayer_products(cell, inlayer_tying.points))
    )
    h, dh = CELL_TYPES[cell].interpolation(shear_tying.points), CELL_TYPES[cell].gradients(shear_tying.points)
    slope = np.einsum("tka,tm->takm", dh, h)
    weights = shear_tying.weights(points)
    return Products(tied, untied, _apply_weights(weights, slope), _apply_weights(weights, slope.swapaxes(2, 3)))


def _inlayer_products(cell: str, points: Array) -> Array:
    dh = CELL_TYPES[cell].gradients(points)
    both = np.einsum("tka,tmb->tabkm", dh, dh)
    return np.stack([both[:, 0, 0], both[:, 1, 1], both[:, 0, 1] + both[:, 1, 0]], axis=1)


def _apply_weights(weights: Array, values: Array) -> Array:
    return np.einsum("qctd,tdkm->qckm", weights, values)


def lagrange(nodes: Array, x: Array) -> Array:
    """Lagrange polynomials (q, n) [1] of nodes (n,) at x (q,)."""
    values = np.ones((len(x), len(nodes)))
    for i, a in enumerate(nodes):
        for b in np.delete(nodes, i):
            values[:, i] *= (x - b) / (a - b)
    return values


def _grid(r: Array, s: Array) -> Array:
    return np.stack(np.meshgrid(r, s, indexing="ij"), axis=-1).reshape(-1, 2)


def _product(r: Array, s: Array, points: Array) -> Array:
    """Interpolation (q, n) over the grid of r and s."""
    interpolation = lagrange(r, points[:, 0])[:, :, None] * lagrange(s, points[:, 1])[:, None, :]
    return interpolation.reshape(len(points), -1)


def _tensor(parts: list[tuple[int, Array, Array]], count: int) -> Tying:
    """Tying of components that each have a separate grid (component, r, s)."""
    tying_points = np.concatenate([_grid(r, s) for _, r, s in parts])
    start = np.cumsum([0, *(len(r) * len(s) for _, r, s in parts)])

    def weights(points: Array) -> Array:
        values = np.zeros((len(points), count, len(tying_points), count))
        for k, (c, r, s) in enumerate(parts):
            values[:, c, start[k] : start[k + 1], c] = _product(r, s, points)
        return values

    return Tying(tying_points, weights)


def _three_shear() -> Tying:
    """e_rt = e_rt(1) + c s, e_st = e_st(2) - c r, c = e_st(2) - e_rt(1) - e_st(3) + e_rt(3)."""
    tying_points = np.array([[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])

    def weights(points: Array) -> Array:
        r, s = points.T
        values = np.zeros((len(points), 2, 3, 2))
        values[:, 0, 0, 0] = values[:, 1, 1, 1] = 1.0
        for row, factor in ((0, s), (1, -r)):
            for t, c, sign in ((1, 1, 1.0), (0, 0, -1.0), (2, 1, -1.0), (2, 0, 1.0)):
                values[:, row, t, c] += sign * factor
        return values

    return Tying(tying_points, weights)


def _six_shear() -> Tying:
    """Rotated quadratic field (8 terms) of two tangential values on each side and both components in the middle."""
    third = 1 / 3
    tying_points = np.array([[LOW, 0], [HIGH, 0], [0, LOW], [0, HIGH], [HIGH, LOW], [LOW, HIGH], [third, third]])
    pick = np.zeros((8, 7, 2))  # values that are matched, over the components at the tying points
    pick[[0, 1], [0, 1], 0] = pick[[2, 3], [2, 3], 1] = 1.0
    pick[[4, 5], [4, 5], 1], pick[[4, 5], [4, 5], 0] = 1.0, -1.0
    pick[6, 6, 0] = pick[7, 6, 1] = 1.0

    def terms(points: Array) -> Array:
        r, s = points.T
        o, ones = 0 * r, 0 * r + 1
        rows = [[ones, r, s, o, o, o, r * s, s * s], [o, o, o, ones, r, s, -r * r, -r * s]]
        return np.moveaxis(np.array(rows), 2, 0)  # (q, 2, 8)

    matched = np.einsum("mtc,tck->mk", pick, terms(tying_points))
    solve = np.linalg.inv(matched)

    def weights(points: Array) -> Array:
        return np.einsum("qck,km,mtd->qctd", terms(points), solve, pick)

    return Tying(tying_points, weights)


def _six_inlayer() -> Tying:
    """rr, ss and the strain qq along the third side, each linear through three points; 2 rs = rr + ss - 2 qq."""
    corner = 1 / np.sqrt(3)
    points_of_components = [
        np.array([[LOW, 0], [HIGH, 0], [LOW, corner]]),
        np.array([[0, LOW], [0, HIGH], [corner, LOW]]),
        np.array([[HIGH, LOW], [LOW, HIGH], [LOW, LOW]]),
    ]
    tying_points = np.concatenate(points_of_components)

    def weights(points: Array) -> Array:
        linear = [np.column_stack([np.ones(len(p)), p]) for p in (points, *points_of_components)]
        rr, ss, qq = (linear[0] @ np.linalg.inv(matrix) for matrix in linear[1:])  # (q, 3)
        values = np.zeros((len(points), 3, 9, 3))
        values[:, 0, 0:3, 0] = values[:, 2, 0:3, 0] = rr
        values[:, 1, 3:6, 1] = values[:, 2, 3:6, 1] = ss
        for c, factor in ((0, 1.0), (1, 1.0), (2, -1.0)):  # 2 qq = rr + ss - 2 rs
            values[:, 2, 6:9, c] -= factor * qq
        return values

    return Tying(tying_points, weights)
