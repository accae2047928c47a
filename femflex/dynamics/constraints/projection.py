"""Multipliers of A u = b that the accelerations take, and projection of a state onto the constraints."""

from __future__ import annotations

import math

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.constraint_violation import constraint_violation
from femflex.dynamics.constraints.multipliers import factorise_products, multipliers
from femflex.dynamics.constraints.row_reduction import whiten_rows, write_response
from femflex.dynamics.constraints.rows import row_of, write_rows, write_targets
from femflex.dynamics.forces.forces import clear_forces
from femflex.dynamics.joints.coordinates import advance_coordinates
from femflex.dynamics.joints.prescribed_motion import prescribed_state
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraint_records import closing_of, constraint_of
from femflex.dynamics.layout.records import body_of, header_of, hold_of
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.rate.rate import CONSTRAIN, place_bodies
from femflex.dynamics.rate.recursion import reduce_to_root
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.entries import ARRAYS, REAL, VECTOR, entry
from femflex.kernels.lanes import offset, pointer

PROJECT = REAL(REAL, VECTOR, *ARRAYS)

NEWTON_STEPS = 10  # of a projection at most; from an integrator's step one or two are taken


@inner
def constraint_response(table: Table, work: Array, stiff: bool) -> Array:
    """M^-1 A^T lambda for the right sides in the rows, in step."""
    step = offset(work, closing_of(table)["step"])
    multipliers(table, work)
    write_response(table, work, step, stiff)
    return step


@entry(CONSTRAIN)
def constrain(t: float, q: Array, u: Array, udot: Array, stiff: int, table: Table, pool: Array, work: Array) -> None:
    """Correct the free accelerations udot by the multipliers that make up the deficit in every row.

    stiff: 1 where the recursion was that of an implicit step.
    """
    write_rows(t, q, u, table, pool, work)
    write_targets(udot, table, work)
    whiten_rows(table, work, stiff == 1)
    factorise_products(table, pool, work)
    step = constraint_response(table, work, stiff == 1)
    for k in range(header_of(table)["n_u"]):
        udot[k] += step[k]


@inner
def prepare(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place the bodies at (q, u), factorise their inertia, and write the rows."""
    place_bodies(t, q, u, table, pool, work)
    clear_forces(table, work)
    reduce_to_root(table, pool, work, 0.0, 0.0, True)
    write_rows(t, q, u, table, pool, work)


@inner
def largest_gap(table: Table, pool: Array, work: Array) -> float:
    """Largest position residual, angles times the characteristic length [m]."""
    closing = closing_of(table)
    length = pool[closing["tolerance"] + 1]
    largest = 0.0
    for i in range(closing["n_constraints"]):
        c = constraint_of(table, i)
        for k in range(c["n_rows"]):
            gap = abs(work[row_of(table, c["first"] + k) + layout.R_GAP])
            if c["kind"] == layout.CONSTRAINT_LOOP and k >= c["n_slides"]:
                gap *= length
            if not gap <= largest:
                largest = gap
    return largest


@inner
def move(q: Array, step: Array, table: Table, pool: Array, work: Array) -> None:
    """Advance the coordinates by an increment (n_u)."""
    head, new_q = header_of(table), offset(work, closing_of(table)["moved"])
    for i in range(1, head["n_bodies"]):
        advance_coordinates(body_of(table, i), q, step, new_q, pool)
    for k in range(head["n_q"]):
        q[k] = new_q[k]


@inner
def aim_residuals(residual: int, table: Table, work: Array) -> None:
    """Right sides that take away the position residual (R_GAP) or the velocity residual (R_SPEED)."""
    for i in range(closing_of(table)["n_rows"]):
        r = row_of(table, i)
        work[r + layout.R_TARGET] = -work[r + residual]


@inner
def set_prescribed(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Set the prescribed freedoms of the state to their prescribed values."""
    q_prescribed, u_prescribed = prescribed_state(t, q, u, table, pool, work)
    for i in range(header_of(table)["n_holds"]):
        hold = hold_of(table, i)
        q[hold["q"]], u[hold["u"]] = q_prescribed[hold["q"]], u_prescribed[hold["u"]]


@inner
def project_state(t: float, q: Array, u: Array, task: int, table: Table, pool: Array, work: Array) -> float:
    """Project (q, u) onto the constraints, or do as the task says; return the remaining violation over its limit."""
    copy_auxiliary_states(u, table, work)
    if header_of(table)["n_holds"] > 0 and task != layout.TASK_MEASURE:
        set_prescribed(t, q, u, table, pool, work)
    gap_before, remaining = math.inf, 0.0
    for k in range(NEWTON_STEPS + 1):
        prepare(t, q, u, table, pool, work)
        gap = largest_gap(table, pool, work)
        if task == layout.TASK_MEASURE:
            break
        whiten_rows(table, work, False)
        factorise_products(table, pool, work)
        closed = gap <= pool[closing_of(table)["tolerance"]] or not gap < 0.5 * gap_before or k == NEWTON_STEPS
        if task == layout.TASK_PROJECT:
            aim_residuals(layout.R_SPEED if closed else layout.R_GAP, table, work)
        step = constraint_response(table, work, False)
        if task == layout.TASK_NEAREST:
            break
        if closed:
            for j in range(header_of(table)["n_u"]):
                u[j] += step[j]
            remaining = constraint_violation(t, u, table, pool, work)
            break
        gap_before = gap
        move(q, step, table, pool, work)
    return remaining


@kernel(PROJECT)
def project(t: float, x: Array, table: Table, pool: Array, work: Array) -> float:
    """Project x onto the constraints, positions then velocities, by the least change in M; return the violation.

    That is the largest residual in units of what it may be: above 1 no state there satisfies the constraints.

    Positions by Newton's method until the gap is that of rounding; the velocities' correction is linear. Without
    motion across the constraints the kinetic energy changes only by the square of what is taken away.

    The task in the work array may ask for less, so that one compiled call serves studies too: TASK_MEASURE only writes
    the rows; TASK_NEAREST writes to `step` the smallest v by M with A v = the rows' right sides; all else is TASK_HOLD.
    """
    records = pointer(table)
    q, u, requested_task = pointer(x), offset(x, header_of(records)["n_q"]), work[closing_of(records)["task"]]
    task = layout.TASK_PROJECT
    if requested_task == layout.TASK_MEASURE:
        task = layout.TASK_MEASURE
    elif requested_task == layout.TASK_NEAREST:
        task = layout.TASK_NEAREST
    return project_state(t, q, u, task, records, pointer(pool), pointer(work))
