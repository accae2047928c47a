"""What constraints report along a run, compiled: residuals, rank, multipliers, and forces on the bodies.

Compiled apart from `constraints`, when a run is first observed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics import constraint_layout as at
from femflex.dynamics.compiled import inner, kernel
from femflex.dynamics.constraint_layout import closing_of, constraint_of
from femflex.dynamics.constraints import largest_gap, solve_motion
from femflex.dynamics.lanes import beyond, start
from femflex.dynamics.layout import W_CIN, body_of, header_of
from femflex.dynamics.multipliers import rank_of
from femflex.dynamics.rows import row_of
from femflex.dynamics.symbols import types
from femflex.dynamics.vectors import ZERO, Vector, add, load3, load9, scale, store3, turn_back

Array = NDArray[np.float64]
Table = NDArray[np.int64]

_vector, _matrix = types.float64[::1], types.float64[:, ::1]
OBSERVE = types.void(_vector, _matrix, _matrix, types.int64[::1], _vector, _vector)

ROW_POSITION, ROW_VELOCITY, ROW_RANK, ROW_FIRST = 0, 1, 2, 3  # of an observed row; then multipliers, then wrenches (6)


@inner
def reaction(i: int, table: Table, work: Array) -> tuple[Vector, Vector]:
    """Force and torque of constraint i on its body at marker Q, inertial components, from the rows' multipliers."""
    c = constraint_of(table, i)
    force, torque = ZERO, ZERO
    for k in range(c["n_rows"]):
        r = row_of(table, c["first"] + k)
        factor = work[r + at.R_LAMBDA]
        force = add(force, scale(factor, load3(work, r + at.R_FQ)))
        torque = add(torque, scale(factor, load3(work, r + at.R_TQ)))
    C = load9(work, body_of(table, c["child"])["work"] + W_CIN)
    return turn_back(C, force), turn_back(C, torque)


@inner
def report(row: Array, table: Table, pool: Array, work: Array) -> None:
    """Fill an observed row from the rows as solve_motion left them."""
    closing = closing_of(table)
    n_rows = closing["n_rows"]
    speed = 0.0
    for i in range(n_rows):
        r = row_of(table, i)
        speed = max(speed, abs(work[r + at.R_SPEED]))
        row[ROW_FIRST + i] = work[r + at.R_LAMBDA]
    row[ROW_POSITION], row[ROW_VELOCITY] = largest_gap(table, pool, work), speed
    row[ROW_RANK] = rank_of(table, work)
    for i in range(closing["n_constraints"]):
        force, torque = reaction(i, table, work)
        store3(row, ROW_FIRST + n_rows + 6 * i, force)
        store3(row, ROW_FIRST + n_rows + 6 * i + 3, torque)


@kernel(OBSERVE)
def observe(times: Array, states: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """Fill rows (n_t, ROW_FIRST + n_rows + 6 n_constraints): residuals, rank, multipliers, forces and torques on Q."""
    records, numbers, scratch = start(table), start(pool), start(work)
    n_q = header_of(records)["n_q"]
    udot = np.empty(states.shape[1])
    for j in range(len(times)):
        q = start(states[j])
        solve_motion(times[j], q, beyond(q, n_q), start(udot), records, numbers, scratch)
        report(start(rows[j]), records, numbers, scratch)
