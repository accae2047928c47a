"""Linear buckling load factors under initial stress."""

from __future__ import annotations

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from femflex.arrays import Array, IntArray
from femflex.fem.deflected import tension_blocks
from femflex.fem.eigen.shift_invert import Factors, factorise
from femflex.fem.structure import Structure
from femflex.reduction.boundary.supported import Supported, negative_pivots, supported, unstressed
from femflex.reduction.limits import CLOSE_TO_BUCKLING, FAR_FROM_BUCKLING
from femflex.reduction.preload.equilibrium import refuse_slack, refuse_untensioned
from femflex.warning import warn_of_physics

CLASSED, EXACT = 1e-2, 1e-10  # tolerance of the stiffness ratio, relative: to see that buckling is far off; else
ROUGHLY, VECTORS, RESTARTS = 1e-3, 12, 8  # of the remaining stiffness; for Lanczos' method, 60 solutions at most
SMALL = 400  # dofs up to which a dense solution is cheaper


def critical_factor(structure: Structure, held: IntArray, enough: float = FAR_FROM_BUCKLING) -> float:
    """Factor [1] on the initial stress at which the structure buckles with dofs `held` (k,) fixed; inf if never.

    Also inf beyond `enough`, and where the stress buckles a structure that without it has no stiffness against some
    motion (a mechanism). Least lambda > 0 with det(K0 + lambda K_sigma) = 0.

    If the structure does not buckle, K = K0 + K_sigma is positive definite, and the largest nu of K0 x = nu K x gives
    lambda = nu / (nu - 1); tension gives nu between 0 and 1. Otherwise the lowest mu of K_sigma x = mu K0 x gives
    lambda = -1 / mu. (Under tension mu clusters at zero, where Lanczos' method takes a hundred times as long.)
    """
    stressed, plain = supported(structure, held), unstressed(structure, held)
    try:
        if stressed.K_stiff.shape[0] > SMALL and not negative_pivots(stressed.factors):
            return _factor_on_supports(stressed, plain.K_stiff, enough)
        lowest = lowest_ratio((stressed.K_stiff - plain.K_stiff).tocsr(), plain.K_stiff)
    except (np.linalg.LinAlgError, RuntimeError):
        return np.inf
    return -1.0 / lowest if lowest * enough < -1.0 else np.inf


def _factor_on_supports(supports: Supported, K0: sparse.csr_array, enough: float) -> float:
    """The factor of a structure on its supports that does not buckle under its stress."""
    least = enough / (enough - 1.0)
    nu = _largest_ratio(K0, supports, min(CLASSED, (least - 1.0) / 4))
    if nu < least * (1.0 - CLASSED):
        return np.inf
    nu = _largest_ratio(K0, supports, EXACT)
    return nu / (nu - 1.0) if nu > least else np.inf


def _largest_ratio(K0: sparse.csr_array, supports: Supported, tolerance: float) -> float:
    """The largest nu of K0 x = nu K x, to a relative tolerance."""
    n = K0.shape[0]
    solve = LinearOperator((n, n), matvec=supports.factors.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(n)
    values = eigsh(K0, 1, supports.K_stiff, Minv=solve, which="LA", v0=start, tol=tolerance, return_eigenvectors=False)
    return float(values[0])


def lowest_ratio(K_sigma: sparse.csr_array, K0: sparse.csr_array) -> float:
    """The lowest mu [1] of K_sigma x = mu K0 x, both (n, n)."""
    if K0.shape[0] <= SMALL:
        return _dense_lowest(K_sigma, K0)[0]
    solve = LinearOperator(K0.shape, matvec=factorise(K0).solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(K0.shape[0])
    values = eigsh(K_sigma, 1, K0, Minv=solve, which="SA", v0=start, return_eigenvectors=False)
    return float(values[0])


def roughly_lowest(K_sigma: sparse.csr_array, K0: sparse.csr_array, factors: Factors) -> tuple[float, Array]:
    """The lowest mu [1] of K_sigma x = mu K0 x and its x (n,), with the factors of K0 and 1 + mu to ROUGHLY.

    A small load takes few steps. Raises RuntimeError after RESTARTS, which may happen if tension stiffens other motions
    many times.
    """
    if K0.shape[0] <= SMALL:
        return _dense_lowest(K_sigma, K0)
    solve = LinearOperator(K0.shape, matvec=factors.solve, dtype=float)
    tangent, start = (K0 + K_sigma).tocsr(), np.random.default_rng(0).standard_normal(K0.shape[0])
    values, vectors = eigsh(
        tangent, 1, K0, Minv=solve, which="SA", v0=start, tol=ROUGHLY, ncv=VECTORS, maxiter=RESTARTS
    )
    return float(values[0]) - 1.0, vectors[:, 0]


def _dense_lowest(K_sigma: sparse.csr_array, K0: sparse.csr_array) -> tuple[float, Array]:
    values, vectors = linalg.eigh(K_sigma.toarray(), K0.toarray(), subset_by_index=[0, 0])
    return float(values[0]), vectors[:, 0]


def refuse_buckled(structure: Structure, held: IntArray) -> None:
    """Raise ValueError if the initial stress buckles the structure with the dofs of numbers `held` (k,) fixed.

    Warns if it is close to buckling.
    """
    if not structure.stressed and not tension_blocks(structure):
        return
    if tension_blocks(structure):
        refuse_untensioned(structure)
        refuse_slack(structure, held)
        return
    key = "critical factor", held.tobytes()
    factor = structure.recalled(key, lambda: critical_factor(structure, held, CLOSE_TO_BUCKLING))
    if factor <= 1.0:
        raise ValueError(
            f"the initial stress buckles the structure: its linear buckling load factor is {factor:.4g}, and must "
            "exceed 1. Lower the prestress or the thermal strain, clamp more groups, or mesh the buckled shape."
        )
    if factor < CLOSE_TO_BUCKLING:
        warn_of_physics(
            f"the initial stress is close to buckling: its linear buckling load factor is {factor:.4g} (limit "
            f"{CLOSE_TO_BUCKLING:g}), which leaves {1 - 1 / factor:.0%} of the stiffness of that shape. Results are "
            "sensitive to small errors of shape, stress and supports. Lower the initial stress, or check these"
        )
