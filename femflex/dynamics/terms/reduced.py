"""Equations of motion from which terms of the ledger have been left out: residual, rate and Newton's correction.

[M -A^T; A 0] (udot, lambda) = (what is left of Q - h, bdot - Adot u): the free accelerations come from the terms that
are left, and what they lack in every row of the constraints gives the multipliers. The rows are kinematics; nothing is
left out there. One call serves models with and without constraints: it is slow either way, and compiled for few, apart
from `rate` and only at the first request.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.equations import add_constraint_response
from femflex.dynamics.constraints.residual import solve
from femflex.dynamics.constraints.rows import write_rows, write_targets
from femflex.dynamics.forces.calls import write_resistance
from femflex.dynamics.forces.system import clear_forces
from femflex.dynamics.joints.coordinates import coordinate_rates
from femflex.dynamics.joints.prescribed_motion import prescribed_state, write_prescribed_rows
from femflex.dynamics.lowering.constraint_layout import closing_of
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states, write_auxiliary_rates
from femflex.dynamics.motion.correction import correct_auxiliary_states
from femflex.dynamics.motion.equations import RATE, place_bodies
from femflex.dynamics.motion.gathering import accelerate_body, write_solution
from femflex.dynamics.motion.recursion import reduce_to_root
from femflex.dynamics.motion.second_order import CORRECT, RESIDUAL
from femflex.dynamics.terms.ledger import write_terms
from femflex.dynamics.terms.rows import PRESCRIBED_UDOT, SPARE, n_rows
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer


@inner
def write_reduced(
    t: float, q: Array, u: Array, udot: Array, out: Array, scratch: Array, table: Table, pool: Array, work: Array
) -> None:
    """out = the sum of the terms that the header's `kept` leaves; room (SPARE + n_terms, n_u) holds spare and rows."""
    head = header_of(table)
    n_u = head["n_u"]
    rows = offset(scratch, SPARE * n_u)
    write_terms(t, q, u, udot, rows, pointer(scratch), table, pool, work)
    for k in range(n_u):
        out[k] = 0.0
    for i in range(n_rows(table)):
        if pool[head["kept"] + i] != 0.0:
            for k in range(n_u):
                out[k] += rows[i * n_u + k]
    if head["n_holds"] > 0:
        write_prescribed_rows(udot, out, table, work)


@kernel(RESIDUAL)
def reduced_residual(
    t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array
) -> None:
    """out = M udot + h - Q with the terms that the header's `kept` leaves."""
    records = pointer(table)
    scratch = np.zeros((SPARE + n_rows(records)) * header_of(records)["n_u"])
    write_reduced(
        t, pointer(q), pointer(u), pointer(udot), pointer(out), scratch, records, pointer(pool), pointer(work)
    )


@inner
def constrain_freely(
    t: float, q: Array, u: Array, udot: Array, c_d: float, c_k: float, table: Table, pool: Array, work: Array
) -> None:
    """Correct free accelerations udot, wherever they come from, by M + c_d D + c_k K until they satisfy every row."""
    head = header_of(table)
    if head["n_holds"] > 0:
        q, u = prescribed_state(t, q, u, table, pool, work)
    place_bodies(t, q, u, table, pool, work)
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        accelerate_body(b, body_of(table, b["parent"]), udot, work)
    write_rows(t, q, u, table, pool, work)
    write_targets(udot, table, work)
    clear_forces(table, work)
    if c_k != 0.0 and head["n_terms"] > 0:
        write_resistance(t, q, u, 0.0, c_k, table, pool, work)  # as the free accelerations were solved for
    reduce_to_root(table, pool, work, c_d, c_k, True)
    add_constraint_response(udot, table, pool, work, c_d != 0.0 or c_k != 0.0)


@kernel(RATE)
def reduced_rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """dx/dt of a model from which terms have been left out; some three to five times the cost of `rate`.

    With constraints the accelerations are then corrected until they satisfy every row.
    """
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    n_u, n_z = head["n_u"], head["n_z"]
    room, bias = np.zeros((SPARE + n_rows(records)) * n_u), np.empty(n_u + n_z)  # -(h - Q), z behind it
    rows, force = pointer(room), pointer(bias)
    q, u, dq, udot = pointer(x), offset(x, head["n_q"]), pointer(dx), offset(dx, head["n_q"])
    write_reduced(t, q, u, rows, force, room, records, numbers, scratch)
    for k in range(n_u):
        force[k] = -force[k]
    for k in range(n_u, n_u + n_z):
        force[k] = u[k]
    # they stand in the specified motion, not in the accelerations solved for
    known_rates = offset(room, PRESCRIBED_UDOT * n_u)
    if head["n_holds"] > 0:
        for k in range(n_u):
            force[k] = force[k] - known_rates[k]
    write_solution(t, q, force, udot, 1.0, 0.0, 0.0, records, numbers, scratch)
    x_q, v = q, u
    if head["n_holds"] > 0:
        for k in range(n_u):
            udot[k] = udot[k] + known_rates[k]
        x_q, v = prescribed_state(t, q, u, records, numbers, scratch)
    write_auxiliary_rates(offset(udot, n_u), records, scratch)
    for i in range(1, head["n_bodies"]):
        coordinate_rates(body_of(records, i), x_q, v, dq, numbers)
    if closing_of(records)["n_constraints"] > 0:
        constrain_freely(t, q, u, udot, 0.0, 0.0, records, numbers, scratch)


@kernel(CORRECT)
def reduced_correct(
    t: float,
    q: Array,
    u: Array,
    udot: Array,
    out: Array,
    c_d: float,
    c_k: float,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Write Newton's correction of udot to out, with the terms that `kept` leaves (see `motion.correction`).

    With constraints the accelerations are then corrected until they satisfy every row. The states' part follows.
    """
    records, scratch = pointer(table), pointer(work)
    head = header_of(records)
    force = np.empty(len(u))
    reduced_residual(t, q, u, udot, force, table, pool, work)
    for k in range(len(u)):
        force[k] = -force[k] if k < head["n_u"] else u[k]
    solve(t, q, force, out, 1.0, c_d, c_k, table, pool, work)
    if closing_of(records)["n_constraints"] > 0:
        for k in range(head["n_u"]):
            out[k] += udot[k]
        constrain_freely(t, pointer(q), pointer(u), pointer(out), c_d, c_k, records, pointer(pool), scratch)
        for k in range(head["n_u"]):
            out[k] -= udot[k]
    if head["n_z"] > 0:
        x, v, numbers, step = pointer(q), pointer(u), pointer(pool), pointer(out)
        copy_auxiliary_states(v, records, scratch)
        if head["n_holds"] > 0:
            x, v = prescribed_state(t, x, v, records, numbers, scratch)
        zdot = offset(pointer(udot), head["n_u"])
        correct_auxiliary_states(t, x, v, step, zdot, c_d, offset(step, head["n_u"]), records, numbers, scratch)
