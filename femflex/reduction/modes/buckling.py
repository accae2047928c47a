"""Buckling under initial stress."""

from __future__ import annotations

import warnings

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from femflex.arrays import Array, IntArray
from femflex.fem.deflected import tension_blocks
from femflex.fem.eigen.modes import factorise
from femflex.fem.eigen.shift_invert import Factors
from femflex.fem.structure import Structure
from femflex.reduction.boundary.pivots import negative_pivots
from femflex.reduction.boundary.supported import Supported, supported, unstressed
from femflex.reduction.preload.equilibrium import refuse_slack, refuse_untensioned
from femflex.warning import PhysicsWarning

CLOSE = 1.25  # times the stress given: below this margin to buckling it is reported
FAR = 1e3  # times the stress given, from which on it counts as never
CLASSED, EXACT = 1e-2, 1e-10  # part of the ratio of stiffness to which it is found, to see that it is far off, and else
ROUGHLY, VECTORS, RESTARTS = 1e-3, 12, 8  # of the stiffness left; of Lanczos' method, some 60 solutions at most
SMALL = 400  # dofs up to which a dense solution is cheaper


def critical_factor(structure: Structure, held: IntArray, enough: float = FAR) -> float:
    """Factor [1] on the initial stress at which the structure buckles with dofs `held` (k,) fixed; inf if never.

    Also inf beyond `enough`, and where the stress buckles a structure that without it has no stiffness against some
    motion (a mechanism). Least lambda > 0 with det(K0 + lambda K_sigma) = 0.

    Under a stress that it bears, K = K0 + K_sigma is positive, and nu of K0 x = nu K x, largest, gives lambda =
    nu / (nu - 1): tension, however much it stiffens, leaves nu in 0 to 1. Under more, K_sigma x = mu K0 x, lowest,
    gives lambda = -1 / mu. (Tension makes mu cluster at zero, where Lanczos' method takes a hundred times as long.)
    """
    on, without = supported(structure, held), unstressed(structure, held)
    try:
        if on.K_stiff.shape[0] > SMALL and not negative_pivots(on.factors):
            return _factor_on_supports(on, without.K_stiff, enough)
        lowest = lowest_ratio((on.K_stiff - without.K_stiff).tocsr(), without.K_stiff)
    except (np.linalg.LinAlgError, RuntimeError):
        return np.inf
    return -1.0 / lowest if lowest * enough < -1.0 else np.inf


def _factor_on_supports(on: Supported, K0: sparse.csr_array, enough: float) -> float:
    """The factor of a structure that bears its stress, on its supports."""
    least = enough / (enough - 1.0)
    nu = _largest_ratio(K0, on, min(CLASSED, (least - 1.0) / 4))
    if nu < least * (1.0 - CLASSED):
        return np.inf
    nu = _largest_ratio(K0, on, EXACT)
    return nu / (nu - 1.0) if nu > least else np.inf


def _largest_ratio(K0: sparse.csr_array, on: Supported, tolerance: float) -> float:
    """Largest nu of K0 x = nu K x, to a part of it."""
    n = K0.shape[0]
    solve = LinearOperator((n, n), matvec=on.factors.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(n)
    found = eigsh(K0, 1, on.K_stiff, Minv=solve, which="LA", v0=start, tol=tolerance, return_eigenvectors=False)
    return float(found[0])


def lowest_ratio(K_sigma: sparse.csr_array, K0: sparse.csr_array) -> float:
    """Lowest mu [1] of K_sigma x = mu K0 x, both (n, n)."""
    if K0.shape[0] <= SMALL:
        return _dense_lowest(K_sigma, K0)[0]
    solve = LinearOperator(K0.shape, matvec=factorise(K0).solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(K0.shape[0])
    found = eigsh(K_sigma, 1, K0, Minv=solve, which="SA", v0=start, return_eigenvectors=False)
    return float(found[0])


def roughly_lowest(K_sigma: sparse.csr_array, K0: sparse.csr_array, factors: Factors) -> tuple[float, Array]:
    """The same and its x (n,), with the factors of K0, 1 + mu [1] to ROUGHLY: a load that hardly counts takes few
    steps.

    Raises RuntimeError where it takes more than RESTARTS, as it may where tension stiffens other motions manifold.
    """
    if K0.shape[0] <= SMALL:
        return _dense_lowest(K_sigma, K0)
    solve = LinearOperator(K0.shape, matvec=factors.solve, dtype=float)
    left, start = (K0 + K_sigma).tocsr(), np.random.default_rng(0).standard_normal(K0.shape[0])
    found, vectors = eigsh(left, 1, K0, Minv=solve, which="SA", v0=start, tol=ROUGHLY, ncv=VECTORS, maxiter=RESTARTS)
    return float(found[0]) - 1.0, vectors[:, 0]


def _dense_lowest(K_sigma: sparse.csr_array, K0: sparse.csr_array) -> tuple[float, Array]:
    every, vectors = linalg.eigh(K_sigma.toarray(), K0.toarray(), subset_by_index=[0, 0])
    return float(every[0]), vectors[:, 0]


def refuse_buckled(structure: Structure, held: IntArray) -> None:
    """Raise ValueError when the initial stress buckles the structure with dofs held (k,), numbers.

    Warns where it is close to that.
    """
    if not structure.stressed and not tension_blocks(structure):
        return
    if tension_blocks(structure):
        refuse_untensioned(structure)
        refuse_slack(structure, held)
        return
    key = "critical factor", held.tobytes()
    factor = structure.recalled(key, lambda: critical_factor(structure, held, CLOSE))
    if factor <= 1.0:
        raise ValueError(
            f"the initial stress buckles the structure: its linear buckling load factor is {factor:.4g}, and must "
            "exceed 1. Lower the prestress or the thermal strain, clamp more groups, or mesh the buckled shape."
        )
    if factor < CLOSE:
        warnings.warn(
            f"the initial stress is close to buckling: its linear buckling load factor is {factor:.4g} (limit "
            f"{CLOSE:g}), which leaves {1 - 1 / factor:.0%} of the stiffness of that shape. Results are sensitive to "
            "small errors of shape, stress and supports. Lower the initial stress, or check these",
            PhysicsWarning,
            stacklevel=3,
        )
