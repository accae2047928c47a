"""Shapes that draw a deploying line in as it bends: u_2 = -1/2 int_0^x (v'^2 + w'^2) dx, to second order exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]

KEPT = 1e-9  # of the largest singular value: products of slopes below it add nothing to the span


@dataclass(frozen=True, eq=False)
class Followers:
    """Axial shapes F_s(xi) / L whose amplitudes are 1/2 delta.A_s delta.

    coefficients (m, n_s) of Legendre polynomials in 2 xi - 1; slaves (n_s, n, n): A_s. The 1 / L goes with the shape,
    so that the A_s are constant.
    """

    coefficients: Array
    slaves: Array

    @property
    def n(self) -> int:
        """Number of shapes."""
        return len(self.slaves)

    def values(self, xi: Array, derivative: int = 0) -> Array:
        """F_s or a derivative by xi (len(xi), n_s)."""
        series = legendre.legder(self.coefficients, derivative) * 2.0**derivative if derivative else self.coefficients
        return np.asarray(legendre.legval(2.0 * xi - 1.0, series, tensor=True).T, float)


def followers_of(slope: Array, share: Array, xi: Array, weight: Array) -> Followers | None:
    """Followers of the slopes (len(xi), m, n) by xi of transverse displacements at Gauss points xi, each of a `share`.

    None where nothing bends.
    """
    n = slope.shape[2]
    i, j = np.triu_indices(n)
    squares = np.einsum("m,kmp,kmp->kp", share, slope[:, :, i], slope[:, :, j])
    if not squares.any():
        return None
    U, size, V = np.linalg.svd(np.sqrt(weight)[:, None] * squares, full_matrices=False)
    kept = size > KEPT * size[0]
    rates = U[:, kept] / np.sqrt(weight)[:, None]  # orthonormal over xi: dF_s/dxi
    degree = min(len(xi) - 1, 2 * len(xi) // 3)
    P = legendre.legvander(2.0 * xi - 1.0, degree)
    projected = (2.0 * np.arange(degree + 1) + 1.0)[:, None] * (P.T @ (weight[:, None] * rates))
    integrated = np.asarray(legendre.legint(projected, lbnd=-1), np.float64) / 2.0
    A = np.zeros((int(kept.sum()), n, n))
    A[:, i, j] = -(size[kept, None] * V[kept])  # 1/2 d.A d = -1/2 sum over all k, l; pairs k < l stand twice in it
    A[:, j, i] = A[:, i, j]
    return Followers(integrated, A)
