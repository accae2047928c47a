"""Terms of eq. (9) one by one, compiled: the source that drives, holds or damps each coordinate.

Every term is written as it stands on the left of M udot + h - Q = 0, so that all of them sum to zero. h splits by its
degree in u (THEORY section 4), from inertia forces alone, at u, -u and 0; everything else is evaluated by itself, with
nothing else there to cancel against. Compiled apart from `rate`, and only at the first request.

The degree in u counts free coordinates alone: held ones move as specified throughout, and their sddot belongs to the
specified motion.

Rows (n_terms, n_u) lie flat; `spare` (SPARE n_u) is room for vectors (n_u,): a system at rest, motion of prescribed
freedoms alone, and trial velocities.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.forces.forces import clear_forces, push_coordinates
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.layout.records import ORBIT_NONE, header_of
from femflex.dynamics.ledger.rows import (
    FIRST_PRESCRIBED,
    FREE_UDOT,
    GRADIENT,
    INERTIA,
    PRESCRIBED_U,
    PRESCRIBED_UDOT,
    SPARE,
    WEIGHT,
    ZEROS,
    n_rows,
    split_moving_mass,
    write_drive_rows,
    write_elastic_rows,
    write_gravity_row,
    write_joint_rows,
    write_term_rows,
    write_velocity_rows,
)
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.rate.gathering import gather_residual
from femflex.dynamics.rate.rate import STAGE, place_and_load_all
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.entries import ARRAYS, MATRIX, VECTOR, VOID, entry
from femflex.kernels.lanes import offset, pointer

LEDGER = VOID(VECTOR, MATRIX, MATRIX, MATRIX, *ARRAYS)


@inner
def split_prescribed(u: Array, udot: Array, spare: Array, table: Table, work: Array) -> None:
    """Write into `spare` zeros, the accelerations of prescribed freedoms alone, and those of the others."""
    head = header_of(table)
    n_u = head["n_u"]
    for k in range(n_u):
        prescribed = head["n_holds"] > 0 and work[head["flags"] + k] != 0.0
        spare[ZEROS * n_u + k] = 0.0
        spare[PRESCRIBED_U * n_u + k] = u[k] if prescribed else 0.0
        spare[PRESCRIBED_UDOT * n_u + k] = work[head["known"] + k] if prescribed else 0.0
        spare[FREE_UDOT * n_u + k] = 0.0 if prescribed else udot[k]


@inner
def write_motion_rows(
    t: float, q: Array, u: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Rows of the motion and of the gravity gradient: those that can be left out of the compiled equations."""
    head = header_of(table)
    write_velocity_rows(t, q, u, rows, spare, table, pool, work)
    if head["orbit"] != ORBIT_NONE:
        write_gravity_row(spare, offset(rows, GRADIENT * head["n_u"]), table, pool, work)
    if head["n_holds"] > 0 or head["n_varying"] > 0:
        split_moving_mass(t, q, u, rows, spare, table, pool, work)


@entry(STAGE)
def place_and_cancel(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place and load all bodies, and push the coordinates with the sum of the terms that `kept` leaves out."""
    head = header_of(table)
    n_u, out = head["n_u"], offset(work, head["left_forces"])
    spare, rows = offset(out, n_u), offset(out, (1 + SPARE) * n_u)
    for k in range(FIRST_PRESCRIBED * n_u):
        rows[k] = 0.0
    split_prescribed(u, u, spare, table, work)
    write_motion_rows(t, q, u, rows, spare, table, pool, work)
    for k in range(n_u):
        out[k] = 0.0
        for i in range(FIRST_PRESCRIBED):
            if pool[head["kept"] + i] == 0.0:
                out[k] += rows[i * n_u + k]
    place_and_load_all(t, q, u, table, pool, work)
    push_coordinates(out, table, work)


@inner
def write_terms(
    t: float, q: Array, u: Array, udot: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """rows (n_terms, n_u): every term at the state (q, u) with the accelerations udot (n_u,)."""
    head = header_of(table)
    n_u = head["n_u"]
    for k in range(n_rows(table) * n_u):
        rows[k] = 0.0
    copy_auxiliary_states(u, table, work)
    if head["n_holds"] > 0:
        q, u = prescribed_state(t, q, u, table, pool, work)
    split_prescribed(u, udot, spare, table, work)
    if head["n_holds"] > 0:
        write_drive_rows(t, q, u, rows, spare, table, pool, work)
    if head["n_terms"] > 0:
        write_term_rows(t, q, u, rows, spare, table, pool, work)
    write_motion_rows(t, q, u, rows, spare, table, pool, work)
    write_elastic_rows(q, u, rows, table, pool, work)
    write_joint_rows(q, u, rows, spare, table, pool, work)
    clear_forces(table, work)
    gather_residual(offset(spare, FREE_UDOT * n_u), offset(rows, INERTIA * n_u), table, pool, work)
    if head["weighs"]:
        write_gravity_row(spare, offset(rows, WEIGHT * n_u), table, pool, work)


@inner
def write_rows_of_run(
    times: Array, states: Array, rates: Array, out: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write the rows of every instant of a run; the caller owns the memory behind `spare`."""
    for j in range(len(times)):
        q = pointer(states[j])
        u = offset(q, header_of(table)["n_q"])
        write_terms(times[j], q, u, pointer(rates[j]), pointer(out[j]), pointer(spare), table, pool, work)


@kernel(LEDGER)
def ledger(times: Array, states: Array, rates: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out (n_t, n_terms n_u): all terms at times (n_t,), states (n_t, n_x) and accelerations (n_t, n_u)."""
    spare = np.zeros(SPARE * rates.shape[1])
    write_rows_of_run(times, states, rates, out, spare, pointer(table), pointer(pool), pointer(work))
