"""Newton's correction of implicit integrators in one pass of the recursion, without residual and right-hand side.

(M + c_d D + c_k K) d = -(M udot + h - Q) is solved for udot + d: (M + c_d D + c_k K) (udot + d) = (c_d D + c_k K) udot
+ Q - h, the equations of motion of bodies and joints that are heavier by c_d D + c_k K, with what these take off.
Compiled apart from `rate`, and only at the first request.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.elastic import write_elastic_block, write_rows
from femflex.dynamics.bodies.stiffening import add_varying_force
from femflex.dynamics.forces.forces import apply_terms, call_relax, write_resistance
from femflex.dynamics.joints.prescribed_motion import add_known_accelerations, prescribed_state
from femflex.dynamics.layout.records import W_RESIST, W_TAU, body_of, header_of, term_of
from femflex.dynamics.rate.auxiliary_states import copy_auxiliary_states, place_of_length
from femflex.dynamics.rate.rate import call_constrain, call_length_steps, n_solutions, place_and_load, place_bodies
from femflex.dynamics.rate.recursion import accelerate, reduce_written
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.entries import ARRAYS, REAL, VECTOR, VOID
from femflex.kernels.lanes import lane, offset, pointer, put_lane, zero_lane

CORRECT = VOID(REAL, VECTOR, VECTOR, VECTOR, VECTOR, REAL, REAL, *ARRAYS)


@inner
def add_resistance(b: Record, udot: Array, pool: Array, work: Array, c_d: float, c_k: float) -> None:
    """Add (c_d D + c_k K) udot to the forces on the joint, and take it off the written elastic rows' bias."""
    free, tau = b["n_h"] - (3 if b["hidden"] else 0), b["work"] + W_TAU
    if b["sprung"]:
        for k in range(free):
            resistance = c_d * pool[b["damper"] + k] + c_k * pool[b["spring"] + k]
            if b["lawful"]:
                resistance += work[b["work"] + W_RESIST + k]
            work[tau + k] += resistance * udot[b["u"] + k]
    row, bias, rates = b["row"], b["border"] + b["row"] + 7, b["ue"]
    for k in range(0, row, 4):
        force = zero_lane()
        for i in range(b["n"]):
            D, K = lane(pool, b["damping"] + row * i + k), lane(pool, b["stiffness"] + row * i + k)
            force = force + udot[rates + i] * (c_d * D + c_k * K)
        put_lane(work, b["accel"] + k, force)
    for k in range(b["n"]):
        work[bias + b["stride"] * k] -= work[b["accel"] + k]
    if b["nonlinear"]:
        add_varying_force(b, work, udot, rates, -c_k, work, bias, b["stride"])


@inner
def resisted_accelerations(
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
) -> tuple[Array, Array]:
    """out = udot + d, the accelerations of the heavier bodies and joints, but for what constraints change.

    Returns the coordinates and velocities with prescribed freedoms at their values.
    """
    head = header_of(table)
    forced = head["constrain"] != 0
    copy_auxiliary_states(u, table, work)
    if head["n_holds"] > 0:
        q, u = prescribed_state(t, q, u, table, pool, work)
    place_and_load(t, q, u, table, pool, work)
    if head["n_terms"] > 0:
        write_resistance(t, q, u, c_d, c_k, table, pool, work)
    if head["n_holds"] > 0:
        add_known_accelerations(table, work)
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        write_rows(b, pool, work)
        write_elastic_block(b, pool, work, c_d, c_k)
        add_resistance(b, udot, pool, work, c_d, c_k)
    reduce_written(table, pool, work, c_d, c_k, forced)
    accelerate(table, work, out, forced)
    return q, u


@inner
def correct_auxiliary_states(
    t: float,
    q: Array,
    u: Array,
    step: Array,
    zdot: Array,
    c_d: float,
    out: Array,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Write Newton's correction of the given dz/dt to out (n_z,): (1 - c_d J)^-1 (zdot - given).

    zdot is that at the velocities u + c_d step, which the same iteration has found: states that follow velocities
    faster than the step would lag an iteration behind otherwise. J = dzdot/dz is known to the terms whose states
    they are.
    """
    head = header_of(table)
    if head["relaxes"] == 1:
        velocities = offset(work, head["moved_u"])
        for k in range(head["n_u"]):
            velocities[k] = u[k] + c_d * step[k]
        place_bodies(t, q, velocities, table, pool, work)
        apply_terms(t, q, velocities, table, pool, work)  # for the rates; the forces are not used any more
    for k in range(head["n_z"]):
        out[k] = work[head["zdot"] + k] - zdot[k]
    for i in range(head["n_terms"]):
        term = term_of(table, i)
        if term["relax"] != 0:
            call_relax(term["relax"], t, zdot, c_d, out, term["at"], term["n"], table, pool, work)


@kernel(CORRECT)
def correct(
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
    """out = -(M + c_d D + c_k K)^-1 (M udot + h - Q - A^T lambda) at the state (q, u), in O(n); or sddot - udot.

    With constraints A (udot + out) = bdot - Adot u; the integrator removes the drift, by `project`. The part of out for
    the states z follows (`correct_auxiliary_states`), that of free lengths with c_k = c_d^2 or near it.
    """
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    x, v, rates, total = pointer(q), pointer(u), pointer(udot), pointer(out)
    head = header_of(records)
    q_now, u_now = x, v
    for k in range(n_solutions(records)):
        if head["n_free"] > 0:
            call_length_steps(head["step_lengths"], t, k, x, v, rates, total, c_d, records, numbers, scratch)
        q_now, u_now = resisted_accelerations(t, x, v, rates, total, c_d, c_k, records, numbers, scratch)
    if head["constrain"] != 0:
        stiff = 1 if c_d != 0.0 or c_k != 0.0 else 0
        call_constrain(head["constrain"], t, q_now, u_now, total, stiff, records, numbers, scratch)
    for k in range(head["n_u"]):
        total[k] -= rates[k]
    if head["n_z"] > 0:
        z, zdot, dz = offset(v, head["n_u"]), offset(rates, head["n_u"]), offset(total, head["n_u"])
        correct_auxiliary_states(t, q_now, u_now, total, zdot, c_d, dz, records, numbers, scratch)
        n = head["n_free"]
        for k in range(n):
            place, change = place_of_length(k, records, numbers), scratch[head["needs"] + (n + 1) * k + n]
            dz[place], dz[place + 1] = z[place + 1] + c_d * change - zdot[place], change
