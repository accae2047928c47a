"""Gravity: of the orbit (eq. 6), its gradient over the bodies and pull on the centre of mass; uniform; and the rest.

Uniform gravity, without an orbit, acts on every body through its first moments (THEORY section 3). Beyond the gradient
form stand attractions and potentials per mass at a place. With Battin's function f(q) = (1 + q)^(3/2) - 1 = q (3 + 3 q
+ q^2) / (1 + (1 + q)^(3/2)) differences of attraction have no cancellation (Battin 1987, section 8.7).
"""

from __future__ import annotations

import math

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.varying import shape_motion
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.records import body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import root
from femflex.kernels.vectors import (
    ZERO,
    Matrix,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    scale,
    store3,
    sub,
    turn,
    turn_back,
)


@formula
def battin(q: float) -> float:
    """(1 + q)^(3/2) - 1."""
    return q * (3.0 + q * (3.0 + q)) / (1.0 + (1.0 + q) * root(1.0 + q))


@inner
def beyond_gradient(mu: float, a0: float, l: Vector, d: Vector) -> tuple[Vector, float]:
    """Attraction beyond its gradient at d from the point of expansion a0 l, and its potential, per mass.

    With e = d/a0, q = 2 l.e + e.e and s = (1 + q)^(-3/2):  a = -(mu/a0^2) [l (s - 1 + 3 l.e) + e (s - 1)]
    """
    e = scale(1.0 / a0, d)
    le, ee = dot(l, e), dot(e, e)
    q = 2.0 * le + ee
    w = math.sqrt(1.0 + q)
    f = battin(q)
    s = -f / (1.0 + f)
    a = scale(-mu / (a0 * a0), add(scale(s + 3.0 * le, l), scale(s, e)))
    return a, mu / a0 * (q / (w * (1.0 + w)) - le - 0.5 * ee + 1.5 * le * le)


@inner
def zonal(mu: float, strengths: Array, highest: int, r: Vector) -> tuple[Vector, float]:
    """Attraction of the zonal harmonics at r from the centre, inertial components, and its potential, per mass.

    U = mu sum_n J_n R_e^n P_n(s) / r^(n+1)        a = -grad U = mu sum_n J_n R_e^n (P'_(n+1) r/|r| - P'_n k) / r^(n+2)

    with s = k.r/|r| and P'_(n+1) = s P'_n + (n + 1) P_n; the pole k is the inertial Z axis. strengths: J_n R_e^n from
    n = 2 on.
    """
    inverse = 1.0 / math.sqrt(dot(r, r))
    s, share = r[2] * inverse, mu * inverse  # share: mu/r^n
    before, P, slope = 1.0, s, 3.0 * s  # P_(n-2), P_(n-1), P'_n
    outward = along = U = 0.0
    for n in range(2, highest + 1):
        before, P = P, before + (2.0 - 1.0 / n) * (s * P - before)
        steeper = s * slope + (n + 1) * P
        share *= inverse
        weight = share * strengths[n - 2] * inverse
        U += weight * P
        outward += weight * steeper
        along -= weight * slope
        slope = steeper
    return add(scale(outward * inverse * inverse, r), (0.0, 0.0, along * inverse)), U


@inner
def tide(mu: float, s: Vector, r: Vector) -> tuple[Vector, float]:
    """Attraction of a third body at s less that at the centre, at r from there, and its potential, per mass.

    a = mu [(s - r)/|s - r|^3 - s/|s|^3] = -mu/|s - r|^3 (r + f(q) s)        q = r.(r - 2 s)/s^2
    U = -mu [1/|s - r| - 1/|s| - s.r/|s|^3]
    """
    s2, rr = dot(s, s), dot(r, r)
    s1 = math.sqrt(s2)
    q = (rr - 2.0 * dot(s, r)) / s2
    w = math.sqrt(1.0 + q)
    a = scale(-mu / (s2 * s1 * (1.0 + q) * w), add(r, scale(battin(q), s)))
    return a, -mu / s1 * (q * q * (2.0 + w) / (2.0 * w * (1.0 + w) ** 2) - 0.5 * rr / s2)


Origin = tuple[Vector, Vector]  # position and velocity, inertial components, from which reported ones count

NO_GRADIENT: Matrix = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inner
def find_center_of_mass(table: Table, pool: Array, work: Array) -> None:
    """Write the centre of mass relative to the base origin, inertial components (3)."""
    head = header_of(table)
    c = ZERO
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        w = b["work"]
        c = add(c, scale(pool[b["mass"]], load3(work, w + at.W_POS)))
        c = add(c, turn_back(load9(work, w + at.W_CIN), load3(work, w + at.W_S)))
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
    if head["orbit"] != at.ORBIT_FREE:
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
        C_iN = load9(work, w + at.W_CIN)
        p = sub(load3(work, w + at.W_POS), c)
        s = turn_back(C_iN, load3(work, w + at.W_S))
        Q = load9(work, w + at.W_Q)
        Ql = add(Ql, turn_back(C_iN, turn(Q, turn(C_iN, l))))
        Ql = add(Ql, add(scale(dot(p, l), add(s, scale(m, p))), scale(dot(s, l), p)))
        trace += Q[0] + Q[4] + Q[8] + 2.0 * dot(p, s) + m * dot(p, p)
    return sub(scale(trace, l), Ql), 2.0 * trace


@inner
def local_field(b: Record, head: Record, l: Vector, strength: float, pool: Array, work: Array) -> tuple[Matrix, Vector]:
    """Gradient F (3, 3) and uniform part of minus the gravity field, body components: -(mu/a0^3)(r - 3 l (l.r))."""
    if head["orbit"] == at.ORBIT_NONE:
        if head["weighs"] == 0:
            return NO_GRADIENT, ZERO
        return NO_GRADIENT, scale(-1.0, turn(load9(work, b["work"] + at.W_CIN), load3(pool, head["gravity"])))
    C_iN = load9(work, b["work"] + at.W_CIN)
    e = turn(C_iN, l)
    k = strength
    F: Matrix = (
        k * (1.0 - 3.0 * e[0] * e[0]), -3.0 * k * e[0] * e[1], -3.0 * k * e[0] * e[2],
        -3.0 * k * e[1] * e[0], k * (1.0 - 3.0 * e[1] * e[1]), -3.0 * k * e[1] * e[2],
        -3.0 * k * e[2] * e[0], -3.0 * k * e[2] * e[1], k * (1.0 - 3.0 * e[2] * e[2]),
    )  # fmt: skip
    p = turn(C_iN, sub(load3(work, b["work"] + at.W_POS), load3(work, head["total"])))
    uniform = turn(F, p)
    if head["orbit"] == at.ORBIT_FREE:
        uniform = sub(uniform, turn(C_iN, load3(work, head["total"] + 3)))
    return F, uniform


@inner
def reference_motion(table: Table, pool: Array, work: Array) -> Origin:
    """Return position and velocity, inertial components, of the origin of reported positions and velocities.

    With an eliminated translation this is the centre of mass (which sits at O); otherwise the base origin.
    """
    head = header_of(table)
    if not body_of(table, 1)["hidden"]:
        return ZERO, ZERO
    find_center_of_mass(table, pool, work)
    momentum = ZERO
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        w = b["work"]
        ds = shape_motion(b, pool, work)[0]
        p = add(cross(load3(work, w + at.W_OMEGA), load3(work, w + at.W_S)), ds)
        p = add(p, scale(pool[b["mass"]], load3(work, w + at.W_VEL)))
        momentum = add(momentum, turn_back(load9(work, w + at.W_CIN), p))
    return load3(work, head["total"]), scale(1.0 / pool[head["mass"]], momentum)
