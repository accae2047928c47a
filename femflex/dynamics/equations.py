"""The equations of motion (9), compiled: rate of the state, residual, and the linear solve of implicit integrators.

Every function here has one fixed signature over flat arrays, so that nothing is compiled per model.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from femflex.dynamics.base import move_base
from femflex.dynamics.forces import write_forces
from femflex.dynamics.inertia import deform
from femflex.dynamics.kinematics import coordinate_rates, place_body
from femflex.dynamics.layout import W_TAU, bodies_of, header_of
from femflex.dynamics.recursion import accelerate, reduce_to_root
from femflex.dynamics.vectors import inner

Array = NDArray[np.float64]
Table = NDArray[np.int64]

_vector = types.float64[::1]
RATE = types.void(types.float64, _vector, _vector, types.int64[::1], _vector, _vector)


@inner
def place(t: float, x: Array, table: Table, pool: Array, work: Array) -> None:
    """Place every body at the state x = (q, u) and write its inertia; joint forces are cleared."""
    bodies = bodies_of(table)
    nq = header_of(table)["n_q"]
    move_base(t, table, pool, work)
    for i in range(1, len(bodies)):
        b = bodies[i]
        place_body(b, bodies[b["parent"]], x, nq, pool, work)
        deform(b, x, pool, work)
        for k in range(6):
            work[b["work"] + W_TAU + k] = 0.0


@njit(RATE, cache=True)
def rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """dx/dt of the state x = (q, u): qdot = N(q) u and M udot = Q - h, in O(n)."""
    bodies = bodies_of(table)
    nq = header_of(table)["n_q"]
    place(t, x, table, pool, work)
    write_forces(t, x, table, pool, work)
    reduce_to_root(table, pool, work, 0.0, 0.0, False)
    accelerate(table, work, dx, nq)
    for i in range(1, len(bodies)):
        coordinate_rates(bodies[i], x[:nq], x[nq:], dx, pool)
