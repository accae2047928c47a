"""Kinematics of the bodies, parent to child: positions by eq. (1), rates and bias accelerations by eq. (2).

From the parent's origin to marker P (which the parent's elastic coordinates move and turn), along the joint's slides,
through its turns to marker Q, and from Q back to the child's origin (Q moves and turns on the child likewise). Bias
accelerations are those with udot = 0 and a parent that does not accelerate; what udot adds stands in H, G and Phi.
"""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.bodies.shapes import copy_shape_coordinates, markers_motion
from femflex.dynamics.bodies.slaves import write_marker_columns, write_slaves
from femflex.dynamics.joints.ball import ball_turn
from femflex.dynamics.layout import records as at
from femflex.kernels.compiled import inner
from femflex.kernels.turns import axis_turn, quaternion_turn
from femflex.kernels.vectors import (
    UNIT,
    ZERO,
    Matrix,
    Vector,
    add,
    cross,
    load3,
    load4,
    load9,
    product,
    scale,
    store3,
    store9,
    store_lane,
    store_rows,
    sub,
    transpose,
    turn,
    turn_back,
)


@inner
def joint_turn(b: Record, q: Array, u: Array, pool: Array, work: Array) -> tuple[Matrix, Vector, Vector]:
    """C_PQ of the joint, and in P components its rate and bias acceleration relative to P (P not turning).

    The columns of turning axes, P components, are left in H (angular rows).
    """
    w = b["work"]
    j, v = b["q"] + b["n_slide"], b["u"] + b["n_slide"]
    if b["ball"] == at.BALL_NONE:
        C = UNIT
        omega = ZERO
        alpha = ZERO
        for k in range(b["n_turn"]):
            axis = load3(pool, b["axes"] + 3 * (b["n_slide"] + k))
            column = turn(C, axis)
            store3(work, w + at.W_H + 8 * (b["n_h"] - b["n_turn"] + k) + 4, column)
            spin = scale(u[v + k], column)
            alpha = add(alpha, cross(omega, spin))
            omega = add(omega, spin)
            C = product(C, axis_turn(axis, q[j + k]))
        return C, omega, alpha
    C = quaternion_turn(load4(q, j)) if b["ball"] == at.BALL_QUATERNION else ball_turn(b, q, pool)
    first = w + at.W_H + 8 * (b["n_h"] - 3) + 4
    store3(work, first, (C[0], C[3], C[6]))
    store3(work, first + 8, (C[1], C[4], C[7]))
    store3(work, first + 16, (C[2], C[5], C[8]))
    return C, turn(C, load3(u, v)), ZERO


@inner
def place_welded(b: Record, parent: Record, pool: Array, work: Array) -> None:
    """place_body for a body welded to its parent between markers that do not move."""
    w, wp = b["work"], parent["work"]
    C_ip, r = load9(pool, b["welded_at"]), load3(pool, b["welded_at"] + 9)
    omega_p = load3(work, wp + at.W_OMEGA)
    velocity = cross(omega_p, r)
    a, alpha = cross(omega_p, velocity), ZERO
    if b["parent"] == 0:
        alpha = load3(work, wp + at.W_ACC + 4)
        a = add(a, add(load3(work, wp + at.W_ACC), cross(alpha, r)))
    store9(work, w + at.W_CPQ, UNIT)
    velocity = turn(C_ip, add(velocity, load3(work, wp + at.W_VEL)))
    write_body_motion(b, parent, work, C_ip, r, turn(C_ip, omega_p), velocity, turn(C_ip, a), turn(C_ip, alpha))


@inner
def place_body(b: Record, parent: Record, q: Array, u: Array, pool: Array, work: Array) -> None:
    """Write the body's attitude, position, rate, bias acceleration and the columns H, G and Phi, from its parent's."""
    copy_shape_coordinates(b, q, u, work)
    if b["n_slaves"]:
        write_slaves(b, pool, work)
    if b["welded"]:
        place_welded(b, parent, pool, work)
        return
    w, wp = b["work"], parent["work"]
    omega_p = load3(work, wp + at.W_OMEGA)

    # parent's origin -> marker P, parent components
    r_P, C_pP = load3(pool, b["place"]), load9(pool, b["place"] + 3)
    v_P, T_P, omega, alpha, lift_P = ZERO, UNIT, omega_p, ZERO, ZERO
    if b["bends"]:
        u_P, v_P, bend, T_P, spin, bias, lift_P = markers_motion(
            pool, b["place"], b["shape"], b["spin"], b["bends"], parent, work
        )
        r_P = add(r_P, u_P)
        C_pP = product(bend, C_pP)
        alpha = add(bias, cross(omega_p, spin))
        omega = add(omega_p, spin)
    a = add(lift_P, cross(omega_p, add(cross(omega_p, r_P), scale(2.0, v_P))))

    # slides: marker P -> hinge point
    t, dt = ZERO, ZERO
    for k in range(b["n_slide"]):
        axis = turn(C_pP, load3(pool, b["axes"] + 3 * k))
        t = add(t, scale(q[b["q"] + k], axis))
        dt = add(dt, scale(u[b["u"] + k], axis))
    a = add(a, add(cross(alpha, t), cross(omega, add(cross(omega, t), scale(2.0, dt)))))
    velocity = add(add(v_P, dt), add(cross(omega_p, r_P), cross(omega, t)))

    # turns: P -> Q
    C_PQ, spin_J, bias_J = joint_turn(b, q, u, pool, work)
    store9(work, w + at.W_CPQ, C_PQ)
    spin_J = turn(C_pP, spin_J)
    alpha = add(alpha, add(turn(C_pP, bias_J), cross(omega, spin_J)))
    omega = add(omega, spin_J)

    # marker Q -> child's origin, child components
    r_Q, C_iQ = load3(pool, b["own_place"]), load9(pool, b["own_place"] + 3)
    v_Q, T_Q, spin_Q, bias_Q, lift_Q = ZERO, UNIT, ZERO, ZERO, ZERO
    if b["own_bends"]:
        u_Q, v_Q, bend, T_Q, spin_Q, bias_Q, lift_Q = markers_motion(
            pool, b["own_place"], b["own_shape"], b["own_spin"], b["own_bends"], b, work
        )
        r_Q = add(r_Q, u_Q)
        C_iQ = product(bend, C_iQ)
    C_iP = product(C_iQ, transpose(C_PQ))
    C_ip = product(C_iP, transpose(C_pP))
    omega_i = sub(turn(C_ip, omega), spin_Q)
    alpha_i = sub(turn(C_ip, alpha), add(bias_Q, cross(omega_i, spin_Q)))
    acceleration_Q = add(cross(alpha_i, r_Q), cross(omega_i, add(cross(omega_i, r_Q), scale(2.0, v_Q))))
    a_i = sub(turn(C_ip, a), add(acceleration_Q, lift_Q))
    r = sub(add(r_P, t), turn_back(C_ip, r_Q))
    if b["parent"] == 0:  # the base frame's acceleration is known beforehand
        alpha_F = load3(work, wp + at.W_ACC + 4)
        a_i = add(a_i, turn(C_ip, add(load3(work, wp + at.W_ACC), cross(alpha_F, r))))
        alpha_i = add(alpha_i, turn(C_ip, alpha_F))
    velocity_i = sub(turn(C_ip, add(velocity, load3(work, wp + at.W_VEL))), add(cross(omega_i, r_Q), v_Q))

    write_body_motion(b, parent, work, C_ip, r, omega_i, velocity_i, a_i, alpha_i)
    write_joint_columns(b, C_iP, r_Q, pool, work)
    if b["own_bends"]:
        write_marker_columns(b, work, b["G"], pool, b["own_shape"], b["own_spin"], T_Q, scale(-1.0, r_Q))
    if b["bends"]:
        write_marker_columns(parent, work, b["Phi"], pool, b["shape"], b["spin"], T_P, sub(r, r_P))


@inner
def write_body_motion(
    b: Record,
    parent: Record,
    work: Array,
    C_ip: Matrix,
    r: Vector,
    omega: Vector,
    velocity: Vector,
    a: Vector,
    alpha: Vector,
) -> None:
    """Write the result of place_body: r in parent components, the rest in the body's; position and attitude follow."""
    w, wp = b["work"], parent["work"]
    store_rows(work, w + at.W_CIP, C_ip)
    store3(work, w + at.W_R, r)
    store3(work, w + at.W_OMEGA, omega)
    store3(work, w + at.W_VEL, velocity)
    store_lane(work, w + at.W_BIAS, a)
    store_lane(work, w + at.W_BIAS + 4, alpha)
    C_pN = load9(work, wp + at.W_CIN)
    store9(work, w + at.W_CIN, product(C_ip, C_pN))
    store3(work, w + at.W_POS, add(load3(work, wp + at.W_POS), turn_back(C_pN, r)))


@inner
def write_joint_columns(b: Record, C_iP: Matrix, r_Q: Vector, pool: Array, work: Array) -> None:
    """Columns H (6 each): acceleration of the child's origin and its rate per udot of the joint, child components."""
    h, n_h = b["work"] + at.W_H, b["n_h"]
    n_sliding = n_h - (b["n_turn"] if b["ball"] == at.BALL_NONE else 3)
    for c in range(n_sliding):
        axis = column_of_unit(c) if b["hidden"] else turn(C_iP, load3(pool, b["axes"] + 3 * c))
        store_lane(work, h + 8 * c, axis)
        store_lane(work, h + 8 * c + 4, ZERO)
    for c in range(n_sliding, n_h):
        axis = turn(C_iP, load3(work, h + 8 * c + 4))
        store_lane(work, h + 8 * c, cross(r_Q, axis))
        store_lane(work, h + 8 * c + 4, axis)


@inner
def column_of_unit(c: int) -> Vector:
    """Column c of the unit matrix."""
    return 1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0
