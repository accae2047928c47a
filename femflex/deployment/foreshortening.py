"""Shapes of the foreshortening of a deploying member, exact to second order: u_2 = -1/2 int_0^x (v'^2 + w'^2) dx."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.deployment.intervals import PiecewisePolynomials, integral_of

SINGULAR_VALUE_LIMIT = 1e-9  # of the largest singular value: products of slopes below it add nothing to the span


@dataclass(frozen=True, eq=False)
class SlavedShapes:
    """Axial shapes F_s(xi) / L whose amplitudes are 1/2 delta.A_s delta.

    functions: the F_s; slaves (n_s, n, n): A_s. The 1 / L goes with the shape, so that the A_s are constant.
    """

    functions: PiecewisePolynomials
    slaves: Array

    @property
    def n(self) -> int:
        """Number of shapes."""
        return len(self.slaves)

    def values(self, xi: Array, derivative: int = 0) -> Array:
        """F_s or a derivative by xi (n_xi, n_s) [m per kg^1/2 m]."""
        return self.functions(xi, derivative)


def slaved_shapes_of(slope: Array, share: Array, weight: Array, knots: Array) -> SlavedShapes | None:
    """Slaved shapes for slopes (q, m, n) by xi of m transverse displacements, with the `share` (m,) of each.

    weight (q,): of the Gauss points of the slopes, the same number of them between each two neighbours of the ends and
    the inner knots. None where nothing bends.
    """
    n = slope.shape[2]
    i, j = np.triu_indices(n)
    squares = np.einsum("m,kmp,kmp->kp", share, slope[:, :, i], slope[:, :, j])
    if not squares.any():
        return None
    U, size, V = np.linalg.svd(np.sqrt(weight)[:, None] * squares, full_matrices=False)
    significant = size > SINGULAR_VALUE_LIMIT * size[0]
    rates = U[:, significant] / np.sqrt(weight)[:, None]  # orthonormal over xi: dF_s/dxi
    edges = np.concatenate([[0.0], knots, [1.0]])
    points = len(weight) // (len(edges) - 1)
    degree = min(points - 1, 2 * points // 3)
    integrated = integral_of(edges, rates.reshape(len(edges) - 1, points, -1), degree)
    A = np.zeros((int(significant.sum()), n, n))
    A[:, i, j] = -(
        size[significant, None] * V[significant]
    )  # 1/2 d.A d = -1/2 sum over all k, l; pairs k < l stand twice in it
    A[:, j, i] = A[:, i, j]
    return SlavedShapes(integrated, A)
