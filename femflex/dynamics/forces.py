"""Forces that act on the system: loads at markers, joint springs and dampers, and the gravity field of the orbit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.inertia import add_elastic_forces, write_velocity_forces
from femflex.dynamics.kinematics import combine, elastic_turn
from femflex.dynamics.layout import (
    BALL_NONE,
    LOAD_BODY,
    LOAD_INERTIAL,
    LOAD_MARKER,
    ORBIT_FREE,
    ORBIT_NONE,
    W_CIN,
    W_CPQ,
    W_P,
    W_POS,
    W_Q,
    W_S,
    W_TAU,
    bodies_of,
    header_of,
    loads_of,
)
from femflex.dynamics.turns import UNIT, ZERO, vector_of, vector_tangent
from femflex.dynamics.vectors import (
    Matrix,
    Vector,
    add,
    cross,
    dot,
    inner,
    load3,
    load9,
    product,
    scale,
    solve3,
    store3,
    sub,
    transpose,
    turn,
    turn_back,
)

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void


@inner
def write_forces(t: float, x: Array, table: Table, pool: Array, work: Array) -> None:
    """Write every body's bias wrench and elastic bias, and every joint's spring forces, at the placed state."""
    bodies = bodies_of(table)
    head = header_of(table)
    nq = head["n_q"]
    gradient = ZERO
    strength = 0.0
    if head["orbit"] != ORBIT_NONE:
        find_center_of_mass(table, pool, work)
        gradient, strength = gravity_field(table, pool, work)
    for i in range(1, len(bodies)):
        b = bodies[i]
        field, uniform = local_field(b, head, gradient, strength, work)
        write_velocity_forces(b, x, nq, pool, work, field, uniform)
        add_elastic_forces(b, x, nq, pool, work)
        if b["sprung"]:
            write_spring_forces(b, x, nq, pool, work)
    loads = loads_of(table)
    for j in range(len(loads)):
        apply_load(t, loads[j], bodies, head, x, pool, work)


@inner
def find_center_of_mass(table: Table, pool: Array, work: Array) -> None:
    """Write the centre of mass relative to the base origin, inertial components (3)."""
    bodies = bodies_of(table)
    head = header_of(table)
    c = ZERO
    for i in range(1, len(bodies)):
        w = bodies[i]["work"]
        arm = add(
            scale(pool[bodies[i]["mass"]], load3(work, w + W_POS)),
            turn_back(load9(work, w + W_CIN), load3(work, w + W_S)),
        )
        c = add(c, arm)
    store3(work, head["total"], scale(1.0 / pool[head["mass"]], c))


@inner
def gravity_field(table: Table, pool: Array, work: Array) -> tuple[Vector, float]:
    """Unit vector l from the Earth to O, inertial components, and mu/a0^3; for a free orbit also the uniform field.

    The uniform field is what accelerates the centre of mass relative to the Kepler motion of O: the difference of the
    central attraction, and the mu/a0^4 force of the quadrupole in eq. (6), -dU/d(a0) at fixed attitude.
    """
    head = header_of(table)
    o, mu = head["orbit_state"], pool[head["orbit_data"]]
    R = load3(work, o + 13)
    if head["orbit"] != ORBIT_FREE:
        radius = work[o]
        return scale(1.0 / radius, R), mu / radius**3
    c = load3(work, head["total"])
    R_c = add(R, c)
    a0 = math.sqrt(dot(R_c, R_c))
    l = scale(1.0 / a0, R_c)
    # mu (R/R^3 - R_c/a0^3) without cancellation (Battin's f(q))
    q = dot(c, sub(c, scale(2.0, R_c))) / (a0 * a0)
    f = q * (3.0 + q * (3.0 + q)) / (1.0 + (1.0 + q) * math.sqrt(1.0 + q))
    radius = math.sqrt(dot(R, R))
    uniform = scale(-mu / radius**3, add(c, scale(f, R_c)))
    J_l, trace = inertia_along(l, c, table, pool, work)
    pull = add(scale(-3.0 * trace + 15.0 * dot(l, J_l), l), scale(-6.0, J_l))
    uniform = add(uniform, scale(0.5 * mu / (a0**4 * pool[head["mass"]]), pull))
    store3(work, head["total"] + 3, uniform)
    return l, mu / a0**3


@inner
def inertia_along(l: Vector, c: Vector, table: Table, pool: Array, work: Array) -> tuple[Vector, float]:
    """J l and tr J of the whole system about its centre of mass c, inertial components [kg m^2]."""
    bodies = bodies_of(table)
    Ql = ZERO
    trace = 0.0
    for i in range(1, len(bodies)):
        w = bodies[i]["work"]
        C_iN = load9(work, w + W_CIN)
        m = pool[bodies[i]["mass"]]
        p = sub(load3(work, w + W_POS), c)
        s = turn_back(C_iN, load3(work, w + W_S))
        Q = load9(work, w + W_Q)
        Ql = add(Ql, turn_back(C_iN, turn(Q, turn(C_iN, l))))
        Ql = add(Ql, add(scale(dot(p, l), add(s, scale(m, p))), scale(dot(s, l), p)))
        trace += Q[0] + Q[4] + Q[8] + 2.0 * dot(p, s) + m * dot(p, p)
    return sub(scale(trace, l), Ql), 2.0 * trace


@inner
def local_field(b: Record, head: Record, l: Vector, strength: float, work: Array) -> tuple[Matrix, Vector]:
    """Gradient F (3, 3) and uniform part of minus the gravity field, body components: -(mu/a0^3)(r - 3 l (l.r))."""
    if head["orbit"] == ORBIT_NONE:
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    C_iN = load9(work, b["work"] + W_CIN)
    e = turn(C_iN, l)
    k = strength
    F: Matrix = (
        k * (1.0 - 3.0 * e[0] * e[0]), -3.0 * k * e[0] * e[1], -3.0 * k * e[0] * e[2],
        -3.0 * k * e[1] * e[0], k * (1.0 - 3.0 * e[1] * e[1]), -3.0 * k * e[1] * e[2],
        -3.0 * k * e[2] * e[0], -3.0 * k * e[2] * e[1], k * (1.0 - 3.0 * e[2] * e[2]),
    )  # fmt: skip
    p = turn(C_iN, sub(load3(work, b["work"] + W_POS), load3(work, head["total"])))
    uniform = turn(F, p)
    if head["orbit"] == ORBIT_FREE:
        uniform = sub(uniform, turn(C_iN, load3(work, head["total"] + 3)))
    return F, uniform


@inner
def write_spring_forces(b: Record, x: Array, nq: int, pool: Array, work: Array) -> None:
    """Write the forces of joint springs and dampers on the joint's quasi-coordinates (n_u)."""
    tau = b["work"] + W_TAU
    free = b["n_slide"] + b["n_turn"]
    for k in range(free):
        stretch = x[b["q"] + k] - pool[b["rest"] + k]
        work[tau + k] = -pool[b["spring"] + k] * stretch - pool[b["damper"] + k] * x[nq + b["u"] + k]
    if b["ball"] == BALL_NONE:
        return
    theta = vector_of(load9(work, b["work"] + W_CPQ))
    k, rest, c, u = b["spring"] + free, b["rest"] + free, b["damper"] + free, nq + b["u"] + free
    pull = (
        -pool[k] * (theta[0] - pool[rest]),
        -pool[k + 1] * (theta[1] - pool[rest + 1]),
        -pool[k + 2] * (theta[2] - pool[rest + 2]),
    )
    torque = solve3(vector_tangent(theta), pull)  # V_theta dtheta/dt with dtheta/dt = T^-T omega
    for j in range(3):
        work[tau + free + j] = torque[j] - pool[c + j] * x[u + j]


@inner
def tabulated(t: float, load: Record, pool: Array, c: int) -> float:
    """Component c of a load's (force, torque) at t: linear between the times, zero outside, a repeated time is a jump."""
    n, times, values = load["n_times"], load["times"], load["values"]
    if n == 0:
        return pool[values + c]
    if t < pool[times] or t > pool[times + n - 1]:
        return 0.0
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if pool[times + middle] <= t:
            low = middle
        else:
            high = middle
    t0, t1 = pool[times + low], pool[times + high]
    if t1 == t0:
        return pool[values + 6 * high + c]
    s = (t - t0) / (t1 - t0)
    return (1.0 - s) * pool[values + 6 * low + c] + s * pool[values + 6 * high + c]


@inner
def load_wrench(
    t: float, load: Record, bodies: Array, head: Record, x: Array, pool: Array, work: Array
) -> tuple[Vector, Vector, Vector, Matrix]:
    """Force, torque and place of a load, and the tangent T of its marker's turn, all in body components."""
    b = bodies[load["body"]]
    C_iN = load9(work, b["work"] + W_CIN)
    force = (tabulated(t, load, pool, 0), tabulated(t, load, pool, 1), tabulated(t, load, pool, 2))
    torque = (tabulated(t, load, pool, 3), tabulated(t, load, pool, 4), tabulated(t, load, pool, 5))
    r = load3(pool, load["place"])
    C_iM = load9(pool, load["place"] + 3)
    T = UNIT
    if load["bends"]:
        r = add(r, combine(pool, load["shape"], b["n"], x, b["qe"]))
        theta = combine(pool, load["spin"], b["n"], x, b["qe"])
        bend, T, _, _ = elastic_turn(theta, ZERO)
        C_iM = product(bend, C_iM)
    if load["frame"] == LOAD_MARKER:
        C = C_iM
    elif load["frame"] == LOAD_INERTIAL:
        C = C_iN
    elif load["frame"] == LOAD_BODY:
        C = UNIT
    else:
        C = product(C_iN, load9(work, head["orbit_state"] + 4))
    return turn(C, force), turn(C, torque), r, T


@inner
def apply_load(t: float, load: Record, bodies: Array, head: Record, x: Array, pool: Array, work: Array) -> None:
    """Take a load off the bias of its body: wrench at the origin, and phi^T force + (T psi)^T torque."""
    b = bodies[load["body"]]
    force, torque, r, T = load_wrench(t, load, bodies, head, x, pool, work)
    w, n = b["work"], b["n"]
    about = add(torque, cross(r, force))
    for j in range(3):
        work[w + W_P + j] -= force[j]
        work[w + W_P + 3 + j] -= about[j]
    if load["bends"]:
        turned = turn(transpose(T), torque)
        shape, spin = load["shape"], load["spin"]
        for k in range(n):
            work[b["pn"] + k] -= (
                force[0] * pool[shape + k] + force[1] * pool[shape + n + k] + force[2] * pool[shape + 2 * n + k]
                + turned[0] * pool[spin + k] + turned[1] * pool[spin + n + k] + turned[2] * pool[spin + 2 * n + k]
            )  # fmt: skip
