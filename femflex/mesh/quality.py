"""Size and shape quality of cells, of any type and order."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES


def sizes(points: Array, cell: str, nodes: IntArray) -> Array:
    """Length [m], area [m^2] or volume [m^3] (n,) of cells with nodes (n, k); volumes are signed."""
    kind = CELL_TYPES[cell]
    if kind.dimension == 0:
        return np.zeros(len(nodes))
    # Exact for the determinant of straight cells, including the factors of a collapsed cell.
    positions, weight = quadrature(kind.shape, kind.order + 1)
    return _determinants(_jacobians(points, cell, nodes, positions)) @ weight


def qualities(points: Array, cell: str, nodes: IntArray) -> Array:
    """Shape quality (n,), 1 equilateral, 0 degenerate, negative where a cell is folded or inside out.

    The mean-ratio measure d det(T)^(2/d) / |T|^2 with T the Jacobian relative to the ideal cell's, minimum over the
    corners (for a pyramid: those of its base) (Knupp, SIAM J. Sci. Comput. 23 (2001) 193-218, section 5). Lines have
    quality 1 unless folded.
    """
    kind = CELL_TYPES[cell]
    d = kind.dimension
    if d == 0:
        return np.ones(len(nodes))
    J = _jacobians(points, cell, nodes, kind.regular_corners)
    if d == 1:
        forward = np.einsum("eqi,ei->eq", J[..., 0], points[nodes[:, 1]] - points[nodes[:, 0]])
        return np.asarray(np.sign(forward).min(axis=1))
    T = J @ np.linalg.inv(kind.ideal)
    det = _determinants(T)
    norm = np.einsum("eqij,eqij->eq", T, T)
    measure = np.sign(det) * d * np.abs(det) ** (2 / d) / np.where(norm > 0, norm, 1.0)
    return np.asarray(measure.min(axis=1))


def quadrature(shape: str, n: int) -> tuple[Array, Array]:
    """Points (k, d) and weights (k,) on the unit cell: Gauss points per axis, squeezed to the corner for simplices."""
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    d = {"line": 1, "triangle": 2, "quad": 2}.get(shape, 3)
    positions = np.stack(np.meshgrid(*[x] * d, indexing="ij"), axis=-1).reshape(-1, d)
    weight = np.prod(np.stack(np.meshgrid(*[w] * d, indexing="ij"), axis=-1).reshape(-1, d), axis=1)
    squeezed = {"triangle": ((1, 0),), "wedge": ((1, 0),), "tetra": ((1, 0), (2, 0), (2, 1))}.get(shape, ())
    factor = positions.copy()
    for axis, by in squeezed:
        weight = weight * (1 - factor[:, by])
        positions[:, axis] *= 1 - factor[:, by]
    return positions, weight


def _jacobians(points: Array, cell: str, nodes: IntArray, positions: Array) -> Array:
    """dx/dxi (n, q, 3, d) at positions (q, d) of the unit cell."""
    return np.asarray(np.einsum("eki,qkd->eqid", points[nodes], CELL_TYPES[cell].gradients(positions), optimize=True))


def _determinants(J: Array) -> Array:
    """Determinants (n, q) of Jacobians (n, q, 3, d); of a surface, signed by the cell's mean normal."""
    d = J.shape[-1]
    if d == 3:
        return np.asarray(np.linalg.det(J))
    if d == 1:
        return np.asarray(np.linalg.norm(J[..., 0], axis=-1))
    normal = np.cross(J[..., 0], J[..., 1])
    mean = normal.mean(axis=1)
    length = np.linalg.norm(normal, axis=-1)
    return np.asarray(length * np.sign(np.einsum("eqi,ei->eq", normal, mean)))
