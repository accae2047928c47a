"""Constraint rows at a placed state: a force and a torque on each of two markers, the residuals, and their bias.

A row says f_Q . v_Q + t_Q . omega_Q + f_P . v_P + t_P . omega_P = b. The same numbers, times the multiplier, are the
forces on the two bodies, so that the rows serve as A and as A^T. Forces on P stand at the place of Q. The motion of the
markers is kept in the work array. Rows A u = b that a user's function writes are copied there and used as they are.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import columns_times, markers_motion, six_lanes, wrench_times_columns
from femflex.dynamics.bodies.slaves import write_marker_columns
from femflex.dynamics.constraints.contact_rows import put_force, put_values, write_disc, write_edge
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraint_records import (
    M_A,
    M_ARM,
    M_C,
    M_COLUMNS,
    M_E,
    M_O,
    M_R,
    M_V,
    closing_of,
    constraint_of,
)
from femflex.dynamics.layout.records import W_ACC, W_CIN, W_OMEGA, W_P, W_POS, W_VEL, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import call_user
from femflex.kernels.lanes import lane, offset, put_lane
from femflex.kernels.pairs import lane_vector, pair_of
from femflex.kernels.vectors import (
    ZERO,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    product,
    scale,
    store3,
    store9,
    store_lane,
    sub,
    transpose,
    turn,
    turn_back,
)


@inner
def move_marker(b: Record, marker: int, shape: int, spin: int, bends: int, m: int, pool: Array, work: Array) -> None:
    """Write a marker's axes, place, velocity, rate, and the part of its accelerations that udot does not give."""
    w = b["work"]
    C_iN, omega = load9(work, w + W_CIN), load3(work, w + W_OMEGA)
    r, C_iM = load3(pool, marker), load9(pool, marker + 3)
    v, turning, bias, lift = ZERO, ZERO, ZERO, ZERO
    if bends:
        displacement, v, bend, T, turning, bias, lift = markers_motion(pool, marker, shape, spin, bends, b, work)
        r, C_iM = add(r, displacement), product(bend, C_iM)
        write_marker_columns(b, work, m + M_COLUMNS, pool, shape, spin, T, ZERO)
    omega_r = cross(omega, r)
    store9(work, m + M_C, product(transpose(C_iN), C_iM))
    store3(work, m + M_R, add(load3(work, w + W_POS), turn_back(C_iN, r)))
    store3(work, m + M_V, turn_back(C_iN, add(load3(work, w + W_VEL), add(omega_r, v))))
    store3(work, m + M_O, turn_back(C_iN, add(omega, turning)))
    store3(work, m + M_A, add(lift, add(cross(omega, omega_r), scale(2.0, cross(omega, v)))))
    store3(work, m + M_E, add(bias, cross(omega, turning)))
    store3(work, m + M_ARM, r)


@inner
def accelerate_marker(b: Record, bends: int, m: int, work: Array) -> None:
    """Complete a marker's accelerations by those of its body and of the shapes, inertial components."""
    w = b["work"]
    C_iN, alpha = load9(work, w + W_CIN), load3(work, w + W_ACC + 4)
    a = add(load3(work, m + M_A), add(load3(work, w + W_ACC), cross(alpha, load3(work, m + M_ARM))))
    e = add(load3(work, m + M_E), alpha)
    if bends:
        lift = columns_times(work, m + M_COLUMNS, b["row"], b["accel"])
        a, e = add(a, lane_vector(lift[0])), add(e, lane_vector(lift[1]))
    store3(work, m + M_A, turn_back(C_iN, a))
    store3(work, m + M_E, turn_back(C_iN, e))


@inner
def push_marker(b: Record, force: Vector, torque: Vector, bends: int, m: int, work: Array) -> None:
    """Take a force and a torque at a marker, body components, off the body's wrench and off its coordinates' bias."""
    p, row = b["work"] + W_P, b["row"]
    store_lane(work, p, sub(load3(work, p), force))
    store_lane(work, p + 4, sub(load3(work, p + 4), add(torque, cross(load3(work, m + M_ARM), force))))
    if bends:
        wrench = pair_of(force, torque)
        for k in range(0, row, 4):
            power = wrench_times_columns(wrench, six_lanes(work, m + M_COLUMNS + k, row))
            put_lane(work, b["pn"] + k, lane(work, b["pn"] + k) - power)


@inner
def write_general(t: float, q: Array, u: Array, c: Record, row: int, table: Table, work: Array) -> None:
    """The user's rows: A, b and the bias as the function left them."""
    n_rows, n_u, g = c["n_rows"], header_of(table)["n_u"], c["general"]
    call_user(c["function"], t, q, u, offset(work, g))
    b = g + n_rows * n_u
    for k in range(n_rows):
        r = row + layout.ROW_SIZE * k
        for j in range(12):
            work[r + j] = 0.0
        work[r + layout.R_SPEED] = general_row_times(c, k, u, table, work) - work[b + k]
        put_values(r, 0.0, work[b + n_rows + k], work)


@inner
def general_row_times(c: Record, k: int, v: Array, table: Table, work: Array) -> float:
    """Row k of a general constraint times v (n_u)."""
    n_u = header_of(table)["n_u"]
    total = 0.0
    for j in range(n_u):
        total += work[c["general"] + k * n_u + j] * v[j]
    return total


@inner
def row_of(table: Table, i: int) -> int:
    """Place of row i in the work array."""
    return closing_of(table)["rows"] + layout.ROW_SIZE * i


@inner
def write_rows(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Write every row's forces, position and velocity residuals and bias at the placed state (q, u)."""
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        row = row_of(table, c["first"])
        if c["kind"] == layout.CONSTRAINT_GENERAL:
            write_general(t, q, u, c, row, table, work)
            continue
        P, Q = body_of(table, c["parent"]), body_of(table, c["child"])
        move_marker(P, c["place_P"], c["shape_P"], c["spin_P"], c["bends_P"], c["motion_P"], pool, work)
        move_marker(Q, c["place_Q"], c["shape_Q"], c["spin_Q"], c["bends_Q"], c["motion_Q"], pool, work)
        if c["kind"] == layout.CONSTRAINT_LOOP:
            write_slides(c, P, Q, row, pool, work)
            write_pairs(c, P, Q, row + layout.ROW_SIZE * c["n_slides"], pool, work)
        elif c["kind"] == layout.CONSTRAINT_DISC:
            write_disc(c, P, Q, row, pool, work)
        else:
            write_edge(c, P, Q, row, pool, work)
        for k in range(c["n_rows"]):
            r = row + layout.ROW_SIZE * k
            work[r + layout.R_SPEED] = row_times(r, c, P, Q, layout.M_V, layout.M_O, work)


@inner
def row_times(r: int, c: Record, P: Record, Q: Record, linear: int, angular: int, work: Array) -> float:
    """A row times the markers' velocities (M_V, M_O) or accelerations (M_A, M_E)."""
    C_P, C_Q = load9(work, P["work"] + W_CIN), load9(work, Q["work"] + W_CIN)
    p, q = c["motion_P"], c["motion_Q"]
    return (
        dot(load3(work, r + layout.R_FP), turn(C_P, load3(work, p + linear)))
        + dot(load3(work, r + layout.R_TP), turn(C_P, load3(work, p + angular)))
        + dot(load3(work, r + layout.R_FQ), turn(C_Q, load3(work, q + linear)))
        + dot(load3(work, r + layout.R_TQ), turn(C_Q, load3(work, q + angular)))
    )


@inner
def write_slides(c: Record, P: Record, Q: Record, row: int, pool: Array, work: Array) -> None:
    """Rows e . (r_Q - r_P) = o with e fixed in P."""
    p, q = c["motion_P"], c["motion_Q"]
    omega = load3(work, p + layout.M_O)
    d = sub(load3(work, q + layout.M_R), load3(work, p + layout.M_R))
    transport = cross(omega, d)
    v = sub(sub(load3(work, q + layout.M_V), load3(work, p + layout.M_V)), transport)  # as seen from P
    swept = scale(-1.0, add(cross(omega, transport), scale(2.0, cross(omega, v))))
    for k in range(c["n_slides"]):
        slide = c["slides"] + 4 * k
        e = turn(load9(work, p + layout.M_C), load3(pool, slide))
        r = row + layout.ROW_SIZE * k
        put_force(r, e, d, ZERO, P, Q, work)
        put_values(r, dot(e, d) - pool[slide + 3], dot(e, swept), work)


@inner
def write_pairs(c: Record, P: Record, Q: Record, row: int, pool: Array, work: Array) -> None:
    """Rows p . s = cosine with p fixed in P and s fixed in Q; their forces are torques along s x p."""
    C_P, C_Q = load9(work, P["work"] + W_CIN), load9(work, Q["work"] + W_CIN)
    omega_P, omega_Q = load3(work, c["motion_P"] + layout.M_O), load3(work, c["motion_Q"] + layout.M_O)
    for k in range(c["n_pairs"]):
        pair = c["pairs"] + 7 * k
        p = turn(load9(work, c["motion_P"] + layout.M_C), load3(pool, pair))
        s = turn(load9(work, c["motion_Q"] + layout.M_C), load3(pool, pair + 3))
        r, e = row + layout.ROW_SIZE * k, cross(s, p)
        store3(work, r + layout.R_FP, ZERO)
        store3(work, r + layout.R_TP, turn(C_P, scale(-1.0, e)))
        store3(work, r + layout.R_FQ, ZERO)
        store3(work, r + layout.R_TQ, turn(C_Q, e))
        rate = add(cross(cross(omega_Q, s), p), cross(s, cross(omega_P, p)))
        put_values(r, dot(p, s) - pool[pair + 6], dot(sub(omega_Q, omega_P), rate), work)


@inner
def write_targets(udot: Array, table: Table, work: Array) -> None:
    """Write bdot - Adot u - A udot of every row as the multipliers' right side; the bodies move with udot."""
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        general = c["kind"] == layout.CONSTRAINT_GENERAL
        P, Q = body_of(table, c["parent"]), body_of(table, c["child"])
        if not general:
            accelerate_marker(P, c["bends_P"], c["motion_P"], work)
            accelerate_marker(Q, c["bends_Q"], c["motion_Q"], work)
        for k in range(c["n_rows"]):
            r = row_of(table, c["first"] + k)
            acceleration = (
                general_row_times(c, k, udot, table, work)
                if general
                else row_times(r, c, P, Q, layout.M_A, layout.M_E, work)
            )
            work[r + layout.R_TARGET] = -work[r + layout.R_BIAS] - acceleration


@inner
def push_row(c: Record, r: int, factor: float, table: Table, work: Array) -> None:
    """Put a row's forces (row at r, of a constraint between markers), times a factor, on its two bodies."""
    if c["parent"] > 0:
        f, t = scale(factor, load3(work, r + layout.R_FP)), scale(factor, load3(work, r + layout.R_TP))
        push_marker(body_of(table, c["parent"]), f, t, c["bends_P"], c["motion_P"], work)
    f, t = scale(factor, load3(work, r + layout.R_FQ)), scale(factor, load3(work, r + layout.R_TQ))
    push_marker(body_of(table, c["child"]), f, t, c["bends_Q"], c["motion_Q"], work)


@inner
def push_rows(table: Table, work: Array) -> None:
    """Put the forces of all constraints between markers on their bodies."""
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        if c["kind"] != layout.CONSTRAINT_GENERAL:
            for k in range(c["n_rows"]):
                r = row_of(table, c["first"] + k)
                push_row(c, r, work[r + layout.R_LAMBDA], table, work)


@inner
def subtract_general(out: Array, table: Table, work: Array) -> None:
    """Subtract the forces of general rows."""
    n_u = header_of(table)["n_u"]
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        if c["kind"] == layout.CONSTRAINT_GENERAL:
            for k in range(c["n_rows"]):
                factor = work[row_of(table, c["first"] + k) + layout.R_LAMBDA]
                for j in range(n_u):
                    out[j] -= factor * work[c["general"] + k * n_u + j]
