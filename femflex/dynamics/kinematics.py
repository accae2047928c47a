"""Where every body is and how it turns: positions by eq. (1), rates and bias accelerations by eq. (2), parent to child.

From the parent's origin to marker P (which the parent's elastic coordinates move and turn), along the joint's slides,
through its turns to marker Q, and from Q back to the child's origin (Q moves and turns on the child likewise). Bias
accelerations are those with udot = 0 and a parent that does not accelerate; what udot adds stands in H, G and Phi.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.layout import (
    BALL_ANGLES,
    BALL_NONE,
    BALL_QUATERNION,
    W_ACC,
    W_BIAS,
    W_CIN,
    W_CIP,
    W_CPQ,
    W_H,
    W_OMEGA,
    W_POS,
    W_R,
    W_RP,
    W_RQ,
    W_VEL,
)
from femflex.dynamics.turns import (
    UNIT,
    ZERO,
    angle_rates,
    angles_of,
    angles_turn,
    axis_turn,
    quaternion_advanced,
    quaternion_rates,
    quaternion_turn,
    vector_spin,
    vector_tangent,
    vector_turn,
)
from femflex.dynamics.vectors import (
    Matrix,
    Vector,
    add,
    cross,
    inner,
    load3,
    load4,
    load9,
    product,
    scale,
    store3,
    store4,
    store9,
    sub,
    transpose,
    turn,
    turn_back,
)

Array = NDArray[np.float64]
Record = np.void


@inner
def combine(pool: Array, rows: int, n: int, x: Array, first: int) -> Vector:
    """rows (3, n) times x[first : first + n]."""
    a = b = c = 0.0
    for k in range(n):
        d = x[first + k]
        a += pool[rows + k] * d
        b += pool[rows + n + k] * d
        c += pool[rows + 2 * n + k] * d
    return a, b, c


@inner
def elastic_turn(theta: Vector, dtheta: Vector) -> tuple[Matrix, Matrix, Vector, Vector]:
    """exp(skew(theta)), its tangent T, the rate T dtheta/dt and (dT/dt) dtheta/dt, in the undeformed axes."""
    spin, bias = vector_spin(theta, dtheta)
    return vector_turn(theta), vector_tangent(theta), spin, bias


@inner
def write_columns(work: Array, out: int, pool: Array, shape: int, spin: int, n: int, T: Matrix, arm: Vector) -> None:
    """Columns (6, n) of a marker seen at a point `arm` away from it: (phi + (T psi) x arm, T psi)."""
    for k in range(n):
        w = turn(T, (pool[spin + k], pool[spin + n + k], pool[spin + 2 * n + k]))
        v = add((pool[shape + k], pool[shape + n + k], pool[shape + 2 * n + k]), cross(w, arm))
        work[out + k], work[out + n + k], work[out + 2 * n + k] = v
        work[out + 3 * n + k], work[out + 4 * n + k], work[out + 5 * n + k] = w


@inner
def joint_turn(b: Record, x: Array, nq: int, pool: Array, work: Array) -> tuple[Matrix, Vector, Vector]:
    """C_PQ of the joint, and in P components its rate and bias acceleration relative to P (P not turning).

    The columns of turning axes, P components, are left in H (angular rows).
    """
    w = b["work"]
    q, u = b["q"] + b["n_slide"], nq + b["u"] + b["n_slide"]
    if b["ball"] == BALL_NONE:
        C = UNIT
        omega = ZERO
        alpha = ZERO
        for k in range(b["n_turn"]):
            axis = load3(pool, b["axes"] + 3 * (b["n_slide"] + k))
            column = turn(C, axis)
            store3(work, w + W_H + 6 * (b["n_h"] - b["n_turn"] + k) + 3, column)
            spin = scale(x[u + k], column)
            alpha = add(alpha, cross(omega, spin))
            omega = add(omega, spin)
            C = product(C, axis_turn(axis, x[q + k]))
        return C, omega, alpha
    if b["ball"] == BALL_QUATERNION:
        C = quaternion_turn(load4(x, q))
    else:
        C = angles_turn(load3(x, q), load3(pool, b["axes"] + 3 * b["n_slide"]))
    first = w + W_H + 6 * (b["n_h"] - 3) + 3
    store3(work, first, (C[0], C[3], C[6]))
    store3(work, first + 6, (C[1], C[4], C[7]))
    store3(work, first + 12, (C[2], C[5], C[8]))
    return C, turn(C, (x[u], x[u + 1], x[u + 2])), ZERO


@inner
def place_welded(b: Record, parent: Record, pool: Array, work: Array) -> None:
    """place_body for a body welded to its parent between markers that do not move."""
    w, wp = b["work"], parent["work"]
    C_ip = load9(pool, b["welded_at"])
    r = load3(pool, b["welded_at"] + 9)
    omega_p = load3(work, wp + W_OMEGA)
    a, alpha = cross(omega_p, cross(omega_p, r)), ZERO
    if b["parent"] == 0:
        alpha = load3(work, wp + W_ACC + 3)
        a = add(a, add(load3(work, wp + W_ACC), cross(alpha, r)))
    store9(work, w + W_CIP, C_ip)
    store3(work, w + W_R, r)
    store3(work, w + W_RQ, load3(pool, b["own_place"]))
    store3(work, w + W_RP, load3(pool, b["place"]))
    store9(work, w + W_CPQ, UNIT)
    store3(work, w + W_OMEGA, turn(C_ip, omega_p))
    store3(work, w + W_BIAS, turn(C_ip, a))
    store3(work, w + W_BIAS + 3, turn(C_ip, alpha))
    store3(work, w + W_VEL, turn(C_ip, add(load3(work, wp + W_VEL), cross(omega_p, r))))
    C_pN = load9(work, wp + W_CIN)
    store9(work, w + W_CIN, product(C_ip, C_pN))
    store3(work, w + W_POS, add(load3(work, wp + W_POS), turn_back(C_pN, r)))


@inner
def place_body(b: Record, parent: Record, x: Array, nq: int, pool: Array, work: Array) -> None:
    """Write the body's attitude, position, rate, bias acceleration and the columns H, G and Phi, from its parent's."""
    if b["welded"]:
        place_welded(b, parent, pool, work)
        return
    w, wp = b["work"], parent["work"]
    n, n_p = b["n"], parent["n"]
    omega_p = load3(work, wp + W_OMEGA)

    # parent's origin -> marker P, parent components
    r_P = load3(pool, b["place"])
    C_pP = load9(pool, b["place"] + 3)
    v_P = ZERO
    T_P = UNIT
    omega = omega_p
    alpha = ZERO
    if b["bends"]:
        r_P = add(r_P, combine(pool, b["shape"], n_p, x, parent["qe"]))
        v_P = combine(pool, b["shape"], n_p, x, nq + parent["ue"])
        theta = combine(pool, b["spin"], n_p, x, parent["qe"])
        dtheta = combine(pool, b["spin"], n_p, x, nq + parent["ue"])
        bend, T_P, spin, bias = elastic_turn(theta, dtheta)
        C_pP = product(bend, C_pP)
        alpha = add(bias, cross(omega_p, spin))
        omega = add(omega_p, spin)
    store3(work, w + W_RP, r_P)
    a = add(cross(omega_p, cross(omega_p, r_P)), scale(2.0, cross(omega_p, v_P)))

    # slides: marker P -> hinge point
    t, dt = ZERO, ZERO
    for k in range(b["n_slide"]):
        axis = turn(C_pP, load3(pool, b["axes"] + 3 * k))
        t = add(t, scale(x[b["q"] + k], axis))
        dt = add(dt, scale(x[nq + b["u"] + k], axis))
    a = add(a, add(cross(alpha, t), add(cross(omega, cross(omega, t)), scale(2.0, cross(omega, dt)))))
    velocity = add(add(v_P, dt), add(cross(omega_p, r_P), cross(omega, t)))

    # turns: P -> Q
    C_PQ, spin_J, bias_J = joint_turn(b, x, nq, pool, work)
    store9(work, w + W_CPQ, C_PQ)
    spin_J = turn(C_pP, spin_J)
    alpha = add(alpha, add(turn(C_pP, bias_J), cross(omega, spin_J)))
    omega = add(omega, spin_J)

    # marker Q -> child's origin, child components
    r_Q = load3(pool, b["own_place"])
    C_iQ = load9(pool, b["own_place"] + 3)
    v_Q, spin_Q, bias_Q = ZERO, ZERO, ZERO
    T_Q = UNIT
    if b["own_bends"]:
        r_Q = add(r_Q, combine(pool, b["own_shape"], n, x, b["qe"]))
        v_Q = combine(pool, b["own_shape"], n, x, nq + b["ue"])
        theta = combine(pool, b["own_spin"], n, x, b["qe"])
        dtheta = combine(pool, b["own_spin"], n, x, nq + b["ue"])
        bend, T_Q, spin_Q, bias_Q = elastic_turn(theta, dtheta)
        C_iQ = product(bend, C_iQ)
    C_ip = product(C_iQ, transpose(product(C_pP, C_PQ)))
    omega_i = sub(turn(C_ip, omega), spin_Q)
    alpha_i = sub(turn(C_ip, alpha), add(bias_Q, cross(omega_i, spin_Q)))
    back = add(cross(alpha_i, r_Q), add(cross(omega_i, cross(omega_i, r_Q)), scale(2.0, cross(omega_i, v_Q))))
    a_i = sub(turn(C_ip, a), back)
    r = sub(add(r_P, t), turn_back(C_ip, r_Q))
    if b["parent"] == 0:  # the base frame's acceleration is known beforehand
        alpha_F = load3(work, wp + W_ACC + 3)
        a_i = add(a_i, turn(C_ip, add(load3(work, wp + W_ACC), cross(alpha_F, r))))
        alpha_i = add(alpha_i, turn(C_ip, alpha_F))
    velocity_i = sub(turn(C_ip, add(velocity, load3(work, wp + W_VEL))), add(cross(omega_i, r_Q), v_Q))

    store9(work, w + W_CIP, C_ip)
    store3(work, w + W_R, r)
    store3(work, w + W_RQ, r_Q)
    store3(work, w + W_OMEGA, omega_i)
    store3(work, w + W_BIAS, a_i)
    store3(work, w + W_BIAS + 3, alpha_i)
    store3(work, w + W_VEL, velocity_i)
    C_pN = load9(work, wp + W_CIN)
    store9(work, w + W_CIN, product(C_ip, C_pN))
    store3(work, w + W_POS, add(load3(work, wp + W_POS), turn_back(C_pN, r)))

    write_joint_columns(b, C_ip, C_pP, r_Q, pool, work)
    if b["own_bends"]:
        write_columns(work, b["G"], pool, b["own_shape"], b["own_spin"], n, T_Q, scale(-1.0, r_Q))
    if b["bends"]:
        write_columns(work, b["Phi"], pool, b["shape"], b["spin"], n_p, T_P, sub(r, r_P))


@inner
def write_joint_columns(b: Record, C_ip: Matrix, C_pP: Matrix, r_Q: Vector, pool: Array, work: Array) -> None:
    """Columns H (6 each): acceleration of the child's origin and its rate per udot of the joint, child components."""
    w = b["work"]
    n_turning = b["n_turn"] if b["ball"] == BALL_NONE else 3
    C_iP = product(C_ip, C_pP)
    for c in range(b["n_h"]):
        h = w + W_H + 6 * c
        if c < b["n_h"] - n_turning:
            if b["hidden"]:
                axis: Vector = (1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0)
            else:
                axis = turn(C_iP, load3(pool, b["axes"] + 3 * c))
            store3(work, h, axis)
            store3(work, h + 3, ZERO)
        else:
            axis = turn(C_iP, load3(work, h + 3))
            store3(work, h, cross(r_Q, axis))
            store3(work, h + 3, axis)


@inner
def coordinate_rates(b: Record, q: Array, u: Array, dq: Array, pool: Array) -> None:
    """qdot = N(q) u of one body's joint and elastic coordinates."""
    for k in range(b["n_slide"] + b["n_turn"]):
        dq[b["q"] + k] = u[b["u"] + k]
    j, v = b["q"] + b["n_slide"], b["u"] + b["n_slide"]
    if b["ball"] == BALL_QUATERNION:
        store4(dq, j, quaternion_rates(load4(q, j), load3(u, v)))
    elif b["ball"] == BALL_ANGLES:
        store3(dq, j, angle_rates(load3(q, j), load3(pool, b["axes"] + 3 * b["n_slide"]), load3(u, v)))
    for k in range(b["n"]):
        dq[b["qe"] + k] = u[b["ue"] + k]


@inner
def advance_coordinates(b: Record, q: Array, step: Array, out: Array, pool: Array) -> None:
    """One body's joint and elastic coordinates after unit time at the constant quasi-velocity `step`."""
    for k in range(b["n_slide"] + b["n_turn"]):
        out[b["q"] + k] = q[b["q"] + k] + step[b["u"] + k]
    j, v = b["q"] + b["n_slide"], b["u"] + b["n_slide"]
    if b["ball"] == BALL_QUATERNION:
        store4(out, j, quaternion_advanced(load4(q, j), load3(step, v)))
    elif b["ball"] == BALL_ANGLES:
        numbers = load3(pool, b["axes"] + 3 * b["n_slide"])
        turned = product(angles_turn(load3(q, j), numbers), vector_turn(load3(step, v)))
        angles = angles_of(turned, numbers)
        for k in range(3):  # shifted by whole turns to lie next to the old ones
            turns = math.floor((q[j + k] - angles[k]) / (2.0 * math.pi) + 0.5)
            out[j + k] = angles[k] + 2.0 * math.pi * turns
    for k in range(b["n"]):
        out[b["qe"] + k] = q[b["qe"] + k] + step[b["ue"] + k]
