"""Gravity: of the orbit (eq. 6), its gradient over the bodies and the pull on the centre of mass; and uniform.

Uniform gravity, without an orbit, acts on every body through its first moments (THEORY section 3).
"""

from __future__ import annotations

import math

from femflex.arrays import Array, Record, Table
from femflex.dynamics.forces.potentials import battin
from femflex.dynamics.lowering.layout import ORBIT_FREE, ORBIT_NONE, W_CIN, W_POS, W_Q, W_S, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import (
    ZERO,
    Matrix,
    Vector,
    add,
    dot,
    load3,
    load9,
    scale,
    store3,
    sub,
    turn,
    turn_back,
)

NO_GRADIENT: Matrix = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inner
def find_center_of_mass(table: Table, pool: Array, work: Array) -> None:
    """Write the centre of mass relative to the base origin, inertial components (3)."""
    head = header_of(table)
    c = ZERO
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        w = b["work"]
        c = add(c, scale(pool[b["mass"]], load3(work, w + W_POS)))
        c = add(c, turn_back(load9(work, w + W_CIN), load3(work, w + W_S)))
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
        return scale(1.0 / radius, R), mu / (radius * radius * radius)
    c = load3(work, head["total"])
    R_c = add(R, c)
    a0 = math.sqrt(dot(R_c, R_c))
    l = scale(1.0 / a0, R_c)
    # mu (R/R^3 - R_c/a0^3) without cancellation
    q = dot(c, sub(c, scale(2.0, R_c))) / (a0 * a0)
    radius = math.sqrt(dot(R, R))
    uniform = scale(-mu / (radius * radius * radius), add(c, scale(battin(q), R_c)))
    J_l, trace = inertia_along(l, c, table, pool, work)
    pull = add(scale(-3.0 * trace + 15.0 * dot(l, J_l), l), scale(-6.0, J_l))
    uniform = add(uniform, scale(0.5 * mu / (a0**4 * pool[head["mass"]]), pull))
    store3(work, head["total"] + 3, uniform)
    return l, mu / (a0 * a0 * a0)


@inner
def inertia_along(l: Vector, c: Vector, table: Table, pool: Array, work: Array) -> tuple[Vector, float]:
    """J l and tr J of the whole system about its centre of mass c, inertial components [kg m^2]."""
    Ql = ZERO
    trace = 0.0
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        w, m = b["work"], pool[b["mass"]]
        C_iN = load9(work, w + W_CIN)
        p = sub(load3(work, w + W_POS), c)
        s = turn_back(C_iN, load3(work, w + W_S))
        Q = load9(work, w + W_Q)
        Ql = add(Ql, turn_back(C_iN, turn(Q, turn(C_iN, l))))
        Ql = add(Ql, add(scale(dot(p, l), add(s, scale(m, p))), scale(dot(s, l), p)))
        trace += Q[0] + Q[4] + Q[8] + 2.0 * dot(p, s) + m * dot(p, p)
    return sub(scale(trace, l), Ql), 2.0 * trace


@inner
def local_field(b: Record, head: Record, l: Vector, strength: float, pool: Array, work: Array) -> tuple[Matrix, Vector]:
    """Gradient F (3, 3) and uniform part of minus the gravity field, body components: -(mu/a0^3)(r - 3 l (l.r))."""
    if head["orbit"] == ORBIT_NONE:
        if head["weighs"] == 0:
            return NO_GRADIENT, ZERO
        return NO_GRADIENT, scale(-1.0, turn(load9(work, b["work"] + W_CIN), load3(pool, head["gravity"])))
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
