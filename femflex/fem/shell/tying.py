"""Where shells sample their covariant strains, and how these are interpolated from there.

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

    at (t, 2); components rr, ss, 2 rs (in-layer), or rt, st (transverse shear)
    """

    at: Array
    weights: Callable[[Array], Array]


@cache
def inlayer(cell: str) -> Tying | None:
    """Tying of the in-layer strains; None where they are taken where they are."""
    return {"quad9": _nine_inlayer, "triangle6": _six_inlayer}.get(cell, lambda: None)()


@cache
def shear(cell: str) -> Tying:
    """Tying of the transverse shear strains."""
    return {"quad": _four_shear, "quad9": _nine_shear, "triangle": _three_shear, "triangle6": _six_shear}[cell]()


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
    """The constants of a cell type at points (q, 2), natural coordinates [1], found once for each set of points."""
    return _products(cell, np.ascontiguousarray(points, float).tobytes())


@cache
def _products(cell: str, raw: bytes) -> Products:
    points = np.frombuffer(raw).reshape(-1, 2)
    untied, within, across = _inlayer_products(cell, points), inlayer(cell), shear(cell)
    own = untied if within is None else _weighted(within.weights(points), _inlayer_products(cell, within.at))
    h, dh = CELL_TYPES[cell].interpolation(across.at), CELL_TYPES[cell].gradients(across.at)
    slope = np.einsum("tka,tm->takm", dh, h)
    weights = across.weights(points)
    return Products(own, untied, _weighted(weights, slope), _weighted(weights, slope.swapaxes(2, 3)))


def _inlayer_products(cell: str, at: Array) -> Array:
    dh = CELL_TYPES[cell].gradients(at)
    both = np.einsum("tka,tmb->tabkm", dh, dh)
    return np.stack([both[:, 0, 0], both[:, 1, 1], both[:, 0, 1] + both[:, 1, 0]], axis=1)


def _weighted(weights: Array, own: Array) -> Array:
    return np.einsum("qctd,tdkm->qckm", weights, own)


def lagrange(nodes: Array, x: Array) -> Array:
    """Lagrange polynomials (q, n) [1] of nodes (n,) at x (q,)."""
    found = np.ones((len(x), len(nodes)))
    for i, a in enumerate(nodes):
        for b in np.delete(nodes, i):
            found[:, i] *= (x - b) / (a - b)
    return found


def _grid(r: Array, s: Array) -> Array:
    return np.stack(np.meshgrid(r, s, indexing="ij"), axis=-1).reshape(-1, 2)


def _product(r: Array, s: Array, points: Array) -> Array:
    """Interpolation (q, n) over the grid of r and s."""
    both = lagrange(r, points[:, 0])[:, :, None] * lagrange(s, points[:, 1])[:, None, :]
    return both.reshape(len(points), -1)


def _tensor(parts: list[tuple[int, Array, Array]], count: int) -> Tying:
    """Tying of components each over a grid of its own (component, r, s)."""
    at = np.concatenate([_grid(r, s) for _, r, s in parts])
    start = np.cumsum([0, *(len(r) * len(s) for _, r, s in parts)])

    def weights(points: Array) -> Array:
        found = np.zeros((len(points), count, len(at), count))
        for k, (c, r, s) in enumerate(parts):
            found[:, c, start[k] : start[k + 1], c] = _product(r, s, points)
        return found

    return Tying(at, weights)


def _four_shear() -> Tying:
    middle, ends = np.array([0.5]), np.array([0.0, 1.0])
    return _tensor([(0, middle, ends), (1, ends, middle)], 2)


def _nine_shear() -> Tying:
    return _tensor([(0, TWO, THREE), (1, THREE, TWO)], 2)


def _nine_inlayer() -> Tying:
    return _tensor([(0, TWO, THREE), (1, THREE, TWO), (2, TWO, TWO)], 3)


def _three_shear() -> Tying:
    """e_rt = e_rt(1) + c s, e_st = e_st(2) - c r, c = e_st(2) - e_rt(1) - e_st(3) + e_rt(3)."""
    at = np.array([[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])

    def weights(points: Array) -> Array:
        r, s = points.T
        found = np.zeros((len(points), 2, 3, 2))
        found[:, 0, 0, 0] = found[:, 1, 1, 1] = 1.0
        for row, factor in ((0, s), (1, -r)):
            for t, c, sign in ((1, 1, 1.0), (0, 0, -1.0), (2, 1, -1.0), (2, 0, 1.0)):
                found[:, row, t, c] += sign * factor
        return found

    return Tying(at, weights)


def _six_shear() -> Tying:
    """Rotated quadratic field (8 terms) of two tangential values on each side and both components in the middle."""
    third = 1 / 3
    at = np.array([[LOW, 0], [HIGH, 0], [0, LOW], [0, HIGH], [HIGH, LOW], [LOW, HIGH], [third, third]])
    pick = np.zeros((8, 7, 2))  # values that are matched, over the components at the tying points
    pick[[0, 1], [0, 1], 0] = pick[[2, 3], [2, 3], 1] = 1.0
    pick[[4, 5], [4, 5], 1], pick[[4, 5], [4, 5], 0] = 1.0, -1.0
    pick[6, 6, 0] = pick[7, 6, 1] = 1.0

    def terms(points: Array) -> Array:
        r, s = points.T
        o, one = 0 * r, 0 * r + 1
        rows = [[one, r, s, o, o, o, r * s, s * s], [o, o, o, one, r, s, -r * r, -r * s]]
        return np.moveaxis(np.array(rows), 2, 0)  # (q, 2, 8)

    matched = np.einsum("mtc,tck->mk", pick, terms(at))
    solve = np.linalg.inv(matched)

    def weights(points: Array) -> Array:
        return np.einsum("qck,km,mtd->qctd", terms(points), solve, pick)

    return Tying(at, weights)


def _six_inlayer() -> Tying:
    """rr, ss and the strain qq along the third side, each linear through three points; 2 rs = rr + ss - 2 qq."""
    corner = 1 / np.sqrt(3)
    own = [
        np.array([[LOW, 0], [HIGH, 0], [LOW, corner]]),
        np.array([[0, LOW], [0, HIGH], [corner, LOW]]),
        np.array([[HIGH, LOW], [LOW, HIGH], [LOW, LOW]]),
    ]
    at = np.concatenate(own)

    def weights(points: Array) -> Array:
        linear = [np.column_stack([np.ones(len(p)), p]) for p in (points, *own)]
        rr, ss, qq = (linear[0] @ np.linalg.inv(one) for one in linear[1:])  # (q, 3)
        found = np.zeros((len(points), 3, 9, 3))
        found[:, 0, 0:3, 0] = found[:, 2, 0:3, 0] = rr
        found[:, 1, 3:6, 1] = found[:, 2, 3:6, 1] = ss
        for c, factor in ((0, 1.0), (1, 1.0), (2, -1.0)):  # 2 qq = rr + ss - 2 rs
            found[:, 2, 6:9, c] -= factor * qq
        return found

    return Tying(at, weights)
