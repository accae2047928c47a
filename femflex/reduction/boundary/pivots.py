"""Factorise and solve tangent matrices of deflected structures, which need not be positive definite."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from femflex.arrays import Array
from femflex.fem.eigen.shift_invert import Factors

ACCURATE = 1e-9  # residual over the size of its summands, up to which a solution with diagonal pivots is used


def factors(K: sparse.csr_array) -> SuperLU:
    """Factors of a symmetric matrix (n, n) in any unit, pivots on its diagonal: their signs are those of its
    eigenvalues."""
    return splu(
        K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True, "Equil": False}
    )


def negative_pivots(solver: Factors) -> int:
    """The number of negative eigenvalues of a factorised symmetric matrix; zero if it has Cholesky factors."""
    return int(np.sum(solver.U.diagonal() < 0.0)) if isinstance(solver, SuperLU) else 0


def solve_tangent(K: sparse.csr_array, b: Array) -> Array:
    """K^-1 b of a symmetric matrix and columns b (n, k).

    Past a limit point a tangent is not positive, and a pivot on the diagonal may be small. Then, and only then, rows
    are exchanged: that breaks symmetry, fills the factors, and takes fifty times as long on a large mesh.
    """
    b = np.ascontiguousarray(b)
    try:
        x = factors(K).solve(b)
        summands = abs(K) @ np.abs(x) + np.abs(b)
        if np.all(np.abs(K @ x - b).max(axis=0) <= ACCURATE * summands.max(axis=0)):
            return np.asarray(x)
    except RuntimeError:  # a pivot that is zero
        pass
    return np.asarray(splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A").solve(b))
