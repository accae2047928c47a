"""The equations of motion (9) with A u = b, compiled: rate of the state, and projection onto the constraints.

Models without constraints use femflex.dynamics.motion.equations instead and never load this.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, Table
from femflex.dynamics.arithmetic.compiled import inner, kernel
from femflex.dynamics.arithmetic.lanes import beyond, start
from femflex.dynamics.arithmetic.symbols import types
from femflex.dynamics.constraints.excess import excess
from femflex.dynamics.constraints.multipliers import factorise_products, multipliers
from femflex.dynamics.constraints.row_reduction import respond, whiten_rows
from femflex.dynamics.constraints.rows import aim_accelerations, row_of, write_rows
from femflex.dynamics.forces.system import clear, release_joints, write_forces
from femflex.dynamics.joints.coordinates import advance_coordinates, coordinate_rates
from femflex.dynamics.joints.held import add_known_accelerations, held_state
from femflex.dynamics.lowering import tie_layout as at
from femflex.dynamics.lowering.layout import body_of, header_of, hold_of
from femflex.dynamics.lowering.tie_layout import closing_of, constraint_of
from femflex.dynamics.motion.equations import RATE, place
from femflex.dynamics.motion.recursion import accelerate, reduce_to_root
from femflex.dynamics.motion.states import take_states, write_state_rates

_vector = types.float64[::1]
_own = (types.int64[::1], _vector, _vector)  # table, pool, work
PROJECT = types.float64(types.float64, _vector, *_own)

NEWTON_STEPS = 10  # of a projection at most; from an integrator's step one or two are taken


@inner
def answer(table: Table, work: Array, stiff: bool) -> Array:
    """M^-1 A^T lambda for the right sides in the rows, in step."""
    step = beyond(work, closing_of(table)["step"])
    multipliers(table, work)
    respond(table, work, step, stiff)
    return step


@inner
def solve_motion(t: float, q: Array, u: Array, udot: Array, table: Table, pool: Array, work: Array) -> None:
    """udot and the rows' multipliers: M udot + h = Q + A^T lambda, A udot = bdot - Adot u."""
    place(t, q, u, table, pool, work)
    release_joints(table, work)
    write_forces(t, q, u, table, pool, work)
    if header_of(table)["n_holds"] > 0:
        add_known_accelerations(table, work)
    reduce_to_root(table, pool, work, 0.0, 0.0, True)
    accelerate(table, work, udot, True)
    constrain(t, q, u, udot, table, pool, work, False)


@inner
def constrain(t: float, q: Array, u: Array, udot: Array, table: Table, pool: Array, work: Array, stiff: bool) -> None:
    """Correct the free accelerations udot: what they lack in every row gives the multipliers.

    stiff: the recursion was that of an implicit step.
    """
    write_rows(t, q, u, table, pool, work)
    aim_accelerations(udot, table, work)
    add_answer(udot, table, pool, work, stiff)


@inner
def add_answer(udot: Array, table: Table, pool: Array, work: Array, stiff: bool) -> None:
    """Add to udot what the multipliers of the rows' right sides give, by the recursion's factors."""
    whiten_rows(table, work, stiff)
    factorise_products(table, pool, work)
    step = answer(table, work, stiff)
    for k in range(header_of(table)["n_u"]):
        udot[k] += step[k]


@kernel(RATE)
def rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """dx/dt of the state x = (q, u, z): qdot = N(q) u, udot of the constrained system, and zdot."""
    records, numbers = start(table), start(pool)
    head = header_of(records)
    q, u, dq, udot = start(x), beyond(x, head["n_q"]), start(dx), beyond(dx, head["n_q"])
    take_states(u, records, start(work))
    if head["n_holds"] > 0:
        q, u = held_state(t, q, u, records, numbers, start(work))
    solve_motion(t, q, u, udot, records, numbers, start(work))
    write_state_rates(beyond(udot, head["n_u"]), records, start(work))
    for i in range(1, head["n_bodies"]):
        coordinate_rates(body_of(records, i), q, u, dq, numbers)


@inner
def prepare(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Place the bodies at (q, u), factorise their inertia, and write the rows."""
    place(t, q, u, table, pool, work)
    clear(table, work)
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
            gap = abs(work[row_of(table, c["first"] + k) + at.R_GAP])
            if c["kind"] == at.CONSTRAINT_LOOP and k >= c["n_slides"]:
                gap *= length
            if not gap <= largest:
                largest = gap
    return largest


@inner
def move(q: Array, step: Array, table: Table, pool: Array, work: Array) -> None:
    """Advance the coordinates by an increment (n_u)."""
    head, moved = header_of(table), beyond(work, closing_of(table)["moved"])
    for i in range(1, head["n_bodies"]):
        advance_coordinates(body_of(table, i), q, step, moved, pool)
    for k in range(head["n_q"]):
        q[k] = moved[k]


@inner
def aim_residuals(what: int, table: Table, work: Array) -> None:
    """Right sides that take away the position residual (R_GAP) or the velocity residual (R_SPEED)."""
    for i in range(closing_of(table)["n_rows"]):
        r = row_of(table, i)
        work[r + at.R_TARGET] = -work[r + what]


@inner
def settle_held(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Put held freedoms of the state where they are held."""
    own_q, own_u = held_state(t, q, u, table, pool, work)
    for i in range(header_of(table)["n_holds"]):
        hold = hold_of(table, i)
        q[hold["q"]], u[hold["u"]] = own_q[hold["q"]], own_u[hold["u"]]


@inner
def bring_back(t: float, q: Array, u: Array, task: int, table: Table, pool: Array, work: Array) -> float:
    """Bring (q, u) onto the constraints, or do what the task says; what is left in units of what may be."""
    take_states(u, table, work)
    if header_of(table)["n_holds"] > 0 and task != at.TASK_MEASURE:
        settle_held(t, q, u, table, pool, work)
    last, left = math.inf, 0.0
    for k in range(NEWTON_STEPS + 1):
        prepare(t, q, u, table, pool, work)
        gap = largest_gap(table, pool, work)
        if task == at.TASK_MEASURE:
            break
        whiten_rows(table, work, False)
        factorise_products(table, pool, work)
        closed = gap <= pool[closing_of(table)["tolerance"]] or not gap < 0.5 * last or k == NEWTON_STEPS
        if task == at.TASK_HOLD:
            aim_residuals(at.R_SPEED if closed else at.R_GAP, table, work)
        step = answer(table, work, False)
        if task == at.TASK_NEAREST:
            break
        if closed:
            for j in range(header_of(table)["n_u"]):
                u[j] += step[j]
            left = excess(t, u, table, pool, work)
            break
        last = gap
        move(q, step, table, pool, work)
    return left


@kernel(PROJECT)
def project(t: float, x: Array, table: Table, pool: Array, work: Array) -> float:
    """Bring x onto the constraints, positions then velocities, along the shortest way by M; what is left.

    That is the largest residual in units of what it may be: above 1 no state there satisfies the constraints.

    Positions by Newton's method until the gap is that of rounding; the velocities' correction is linear. Without
    motion across the constraints the kinetic energy changes only by the square of what is taken away.

    The task in the work array may ask for less, so that one compiled call serves studies too: TASK_MEASURE only writes
    the rows; TASK_NEAREST writes to `step` the smallest v by M with A v = the rows' right sides; all else is TASK_HOLD.
    """
    records = start(table)
    q, u, asked = start(x), beyond(x, header_of(records)["n_q"]), work[closing_of(records)["task"]]
    task = at.TASK_HOLD
    if asked == at.TASK_MEASURE:
        task = at.TASK_MEASURE
    elif asked == at.TASK_NEAREST:
        task = at.TASK_NEAREST
    return bring_back(t, q, u, task, records, start(pool), start(work))
