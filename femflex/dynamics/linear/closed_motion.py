"""Small motions of systems with loops: independent freedoms, directions that close every loop, loop forces.

Loops are g(q) = 0 with dg = A dxi. Rows of A may depend on each other, as those of a flat linkage do in space; `slack`
is the part of the largest below which a row does (`slack_of_loops`).
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.lowering.constraints import dependence_limit
from femflex.system import System

DEPENDENT = 1e-9  # of the largest, below which a row of A follows from others


def independent_coordinates(A: Array, sizes: Array, slack: float) -> tuple[IntArray, Array]:
    """Freedoms that the others follow, and Z (n, m) of dxi = Z dxi_independent with A Z = 0.

    Those that A (n_rows, n) moves most, measured in usual sizes (n,), are made to follow.
    """
    from scipy.linalg import qr

    scaled = A * sizes
    R, order = qr(scaled, mode="r", pivoting=True)
    pivots = np.abs(np.diag(R))
    rank = int((pivots > slack * pivots.max(initial=0.0)).sum())
    dependent, independent = order[:rank], np.sort(order[rank:]).astype(np.int64)
    Z = np.zeros((len(sizes), len(independent)))
    Z[independent, np.arange(len(independent))] = 1.0
    Z[dependent] = -np.linalg.lstsq(scaled[:, dependent], scaled[:, independent], rcond=None)[0]
    return independent, sizes[:, None] * Z / sizes[independent]


def closing_directions(A: Array, slack: float) -> Array:
    """Orthonormal directions (n, m) along which A (n_rows, n) keeps every loop closed."""
    _, sigma, Vt = np.linalg.svd(A)
    rank = int((sigma > slack * sigma.max(initial=0.0)).sum())
    return np.ascontiguousarray(Vt[rank:].T)


def least_multipliers(A: Array, force: Array, slack: float) -> Array:
    """Return the smallest multipliers (n_rows,) with A^T lambda nearest to a generalised force (n,)."""
    return np.asarray(np.linalg.lstsq(A.T, force, rcond=slack)[0], float)


def slack_of_loops(system: System) -> float:
    """The part of the largest below which a row of A follows from others."""
    return dependence_limit(system, DEPENDENT)


def refuse_rolling(system: System, what: str) -> None:
    """Raise ValueError when nonholonomic constraints act on the system: they leave no set of positions to search."""
    if system.constraints:
        raise ValueError(
            f"{', '.join(repr(c.name) for c in system.constraints)}: nonholonomic constraints restrict velocities and "
            f"not positions, so {what} cannot be found with them; leave them out, or let a damped run "
            "come to rest"
        )
