"""Constraint rows at a placed state: a force and a torque on each of two markers, the residuals, and their bias.

A row says f_Q . v_Q + t_Q . omega_Q + f_P . v_P + t_P . omega_P = b. The same numbers, times the multiplier, are the
forces on the two bodies, so that the rows serve as A and as A^T. Forces on P stand at the place of Q.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.constraints.contact_rows import put_force, put_values, write_disc, write_edge
from femflex.dynamics.constraints.general_rows import general_row_times, write_general
from femflex.dynamics.constraints.marker_motion import accelerate_marker, move_marker, push_marker
from femflex.dynamics.lowering import constraint_layout as layout
from femflex.dynamics.lowering.constraint_layout import closing_of, constraint_of
from femflex.dynamics.lowering.layout import W_CIN, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import ZERO, add, cross, dot, load3, load9, scale, store3, sub, turn


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
