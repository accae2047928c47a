"""Buckling under initial stress."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh

from femflex.fem.eigen.modes import factorised
from femflex.fem.structure import Structure
from femflex.fem.tables import assemble_blocks
from femflex.reduction.clamps import free_dofs
from femflex.warning import PhysicsWarning

Array = NDArray[np.float64]
Index = NDArray[np.int64]

CLOSE = 1.25  # times the stress given: below this margin to buckling it is told
ROUGHLY, RESTARTS = 1e-3, 4  # part of an eigenvalue; of Lanczos' method, some 50 solutions
SMALL = 400  # dofs up to which a dense solution is cheaper


def critical_factor(structure: Structure, held: Index) -> float:
    """Times the initial stress at which the structure with these dofs held buckles, inf where it never does.

    Also inf where the structure has no stiffness of its own against some motion (a mechanism, a membrane, a tether).
    Least lambda > 0 with det(K0 + lambda K_sigma) = 0, from K_sigma x = mu K0 x: lambda = -1 / mu.
    """
    free = free_dofs(structure, held)
    K0 = assemble_blocks(structure.strain, structure.T)[free][:, free]
    K_sigma = structure.K[free][:, free] - K0
    try:
        lowest = lowest_ratio(K_sigma, K0)
    except (np.linalg.LinAlgError, RuntimeError):
        return np.inf
    return -1.0 / lowest if lowest < 0 else np.inf


def lowest_ratio(K_sigma: sparse.csr_array, K0: sparse.csr_array) -> float:
    """Lowest mu of K_sigma x = mu K0 x."""
    return _lowest(K_sigma, K0, 0.0, None)[0]


def roughly_lowest(K_sigma: sparse.csr_array, K0: sparse.csr_array, factors: SuperLU) -> tuple[float, Array]:
    """The same to ROUGHLY and its x (n,), with the factors of K0.

    Raises RuntimeError where it takes more than RESTARTS, as it does where it is one of a cluster at zero.
    """
    return _lowest(K_sigma, K0, ROUGHLY, RESTARTS, factors)


def _lowest(
    K_sigma: sparse.csr_array,
    K0: sparse.csr_array,
    tolerance: float,
    restarts: int | None,
    factors: SuperLU | None = None,
) -> tuple[float, Array]:
    """The lowest mu and its x."""
    if K0.shape[0] <= SMALL:
        every, vectors = linalg.eigh(K_sigma.toarray(), K0.toarray(), subset_by_index=[0, 0])
        return float(every[0]), vectors[:, 0]
    solve = LinearOperator(K0.shape, matvec=(factors or factorised(K0)).solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(K0.shape[0])
    found, vectors = eigsh(K_sigma, 1, K0, Minv=solve, which="SA", v0=start, tol=tolerance, maxiter=restarts)
    return float(found[0]), vectors[:, 0]


def refuse_buckled(structure: Structure, held: Index) -> None:
    """Raise ValueError when the initial stress is more than the structure with these dofs held can bear.

    Warns where it is close to that.
    """
    if not structure.stressed:
        return
    factor = critical_factor(structure, held)
    if factor <= 1.0:
        raise ValueError(
            f"the initial stress buckles the structure: it bears {factor:.4g} times the stress given. Lower the "
            "prestress or the thermal strain, hold more of its groups, or give the mesh the buckled shape."
        )
    if factor < CLOSE:
        warnings.warn(
            f"the initial stress is close to what buckles the structure: it bears {factor:.4g} times the stress given, "
            f"less than {CLOSE:g}, and has {1 - 1 / factor:.0%} of its stiffness left in that shape. Small errors of "
            "shape, stress and support count there",
            PhysicsWarning,
            stacklevel=3,
        )
