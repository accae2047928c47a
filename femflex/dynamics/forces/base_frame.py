"""Motion of the base frame: inertial axes, uniform spin, or the orbital frame on an ellipse."""

from __future__ import annotations

import math

from femflex.arrays import Array, Table
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.records import body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.profiles import profile_at
from femflex.kernels.turns import axis_turn
from femflex.kernels.vectors import (
    UNIT,
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
    transpose,
    turn,
    turn_back,
)

POLE: Vector = (0.0, 0.0, 1.0)  # inertial components
NORMAL: Vector = (1.0, 0.0, 0.0)  # to the orbit, orbital components
JERK_STEP = 0.5  # s, over which the rate of the acceleration along an ephemeris is taken
KEPLER_STEPS = 30  # Newton steps at most; from E = M + e sin M + ... ten are enough below e = 0.99


@inner
def eccentric_anomaly(mean: float, e: float) -> float:
    """E of Kepler's equation E - e sin E = M, by Newton's method to rounding."""
    M = mean - 2.0 * math.pi * math.floor(mean / (2.0 * math.pi) + 0.5)
    E = M + e * math.sin(M) / (1.0 - math.sin(M + e) + math.sin(M)) if e < 0.8 else math.copysign(math.pi, M)
    for _ in range(KEPLER_STEPS):
        step = (E - e * math.sin(E) - M) / (1.0 - e * math.cos(E))
        E -= step
        if abs(step) < 1e-15:
            break
    return E + mean - M


@inner
def move_orbit(t: float, table: Table, pool: Array, work: Array) -> None:
    """Write the orbit's state at t: radius, rate of the orbital frame, C_NO, place, velocity, acceleration, anomaly.

    Rate and acceleration of the frame stand in its own components.
    """
    head = header_of(table)
    d, o = head["orbit_data"], head["orbit_state"]
    if pool[d + 17] != 0.0:
        follow_path(t, d, o, pool, work)
        return
    mu, a, e, n, M0 = pool[d + 14], pool[d + 1], pool[d + 2], pool[d + 3], pool[d + 4]
    E = eccentric_anomaly(M0 + n * t, e)
    cos_E, sin_E = math.cos(E), math.sin(E)
    radius = a * (1.0 - e * cos_E)
    root = math.sqrt(1.0 - e * e)
    cos_nu, sin_nu = a * (cos_E - e) / radius, a * root * sin_E / radius
    rate = math.sqrt(mu * a) * root / (radius * radius)
    radius_rate = math.sqrt(mu / a) / root * e * sin_nu
    C_NP = load9(pool, d + 5)
    C_PO = (0.0, cos_nu, -sin_nu, 0.0, sin_nu, cos_nu, 1.0, 0.0, 0.0)
    work[o] = radius
    store3(work, o + 1, (rate, 0.0, 0.0))
    store9(work, o + 4, product(C_NP, C_PO))
    store3(work, o + 13, turn(C_NP, (radius * cos_nu, radius * sin_nu, 0.0)))
    store3(work, o + 16, turn(C_NP, (-math.sqrt(mu / a) / root * sin_nu, math.sqrt(mu / a) / root * (e + cos_nu), 0.0)))
    store3(work, o + 19, (-2.0 * radius_rate * rate / radius, 0.0, 0.0))
    work[o + 22] = E + 2.0 * math.atan2(e * sin_E, 1.0 + root - e * cos_E)
    if pool[d + 15] != 0.0 or pool[d + 16] != 0.0:
        turn_orbit(t, pool[d + 15], pool[d + 16], o, work)


@inner
def follow_path(t: float, d: int, o: int, pool: Array, work: Array) -> None:
    """Write the orbit's state at t from profiles of the position of O; its anomaly is that of the osculating ellipse.

    With h = r x v and the acceleration a, the orbital frame turns at h/r^2 about x0 and r a_x/h about y0.
    """
    x, vx, ax = profile_at(t, int(pool[d + 18]), pool)
    y, vy, ay = profile_at(t, int(pool[d + 19]), pool)
    z, vz, az = profile_at(t, int(pool[d + 20]), pool)
    r, v, a = (x, y, z), (vx, vy, vz), (ax, ay, az)
    radius = math.sqrt(dot(r, r))
    normal = cross(r, v)
    h = math.sqrt(dot(normal, normal))
    x0, y0 = scale(1.0 / h, normal), scale(1.0 / radius, r)
    z0 = cross(x0, y0)
    speed, along, out = dot(v, y0), dot(a, z0), dot(a, x0)
    rate, turning = h / (radius * radius), radius * out / h
    step = JERK_STEP
    before, after = max(t - step, pool[int(pool[d + 18]) + 3]), min(t + step, pool[int(pool[d + 18]) + 4])
    _, _, jx = profile_at(after, int(pool[d + 18]), pool)
    _, _, jy = profile_at(after, int(pool[d + 19]), pool)
    _, _, jz = profile_at(after, int(pool[d + 20]), pool)
    _, _, kx = profile_at(before, int(pool[d + 18]), pool)
    _, _, ky = profile_at(before, int(pool[d + 19]), pool)
    _, _, kz = profile_at(before, int(pool[d + 20]), pool)
    jerk = dot(scale(1.0 / (after - before), (jx - kx, jy - ky, jz - kz)), x0)
    h_rate = radius * along
    out_rate = jerk - turning * along  # x0' = -turning z0
    work[o] = radius
    store3(work, o + 1, (rate, turning, 0.0))
    store9(work, o + 4, (x0[0], y0[0], z0[0], x0[1], y0[1], z0[1], x0[2], y0[2], z0[2]))
    store3(work, o + 13, r)
    store3(work, o + 16, v)
    alpha_y = speed * out / h - radius * out * h_rate / (h * h) + radius * out_rate / h
    store3(work, o + 19, (h_rate / (radius * radius) - 2.0 * rate * speed / radius, alpha_y, 0.0))
    p = h * h / pool[d + 14]
    work[o + 22] = math.atan2(speed * h / pool[d + 14], p / radius - 1.0)


@inner
def turn_orbit(t: float, node_rate: float, perigee_rate: float, o: int, work: Array) -> None:
    """Turn the orbit's state by the drift of its node, about the pole k, and of its perigee, about the normal x0."""
    C_NO = load9(work, o + 4)
    velocity = turn_back(C_NO, load3(work, o + 16))
    C_NO = product(axis_turn(POLE, node_rate * t), product(C_NO, axis_turn(NORMAL, perigee_rate * t)))
    precession = scale(node_rate, turn_back(C_NO, POLE))
    drift = add(precession, scale(perigee_rate, NORMAL))
    place = (0.0, work[o], 0.0)
    omega = add(load3(work, o + 1), drift)
    store3(work, o + 1, omega)
    store9(work, o + 4, C_NO)
    store3(work, o + 13, turn(C_NO, place))
    store3(work, o + 16, turn(C_NO, add(velocity, cross(drift, place))))
    store3(work, o + 19, add(load3(work, o + 19), cross(precession, omega)))


@inner
def move_base(t: float, table: Table, pool: Array, work: Array) -> None:
    """Write the base frame's attitude, rate and acceleration at t into record 0, and the orbit's state."""
    head = header_of(table)
    w = body_of(table, 0)["work"]
    if head["orbit"] != at.ORBIT_NONE:
        move_orbit(t, table, pool, work)
    C_FN, omega, alpha = UNIT, ZERO, ZERO
    if head["frame"] == at.FRAME_SPINNING:
        omega = load3(pool, head["frame_data"])
        speed = math.sqrt(omega[0] ** 2 + omega[1] ** 2 + omega[2] ** 2)
        if speed > 0.0:
            C_FN = transpose(axis_turn(scale(1.0 / speed, omega), speed * t))
    elif head["frame"] == at.FRAME_ORBITAL:
        o = head["orbit_state"]
        C_FN = transpose(load9(work, o + 4))
        omega = load3(work, o + 1)
        alpha = load3(work, o + 19)
    store9(work, w + at.W_CIN, C_FN)
    store3(work, w + at.W_OMEGA, omega)
    store3(work, w + at.W_ACC, ZERO)
    store3(work, w + at.W_ACC + 4, alpha)
    store3(work, w + at.W_POS, ZERO)
    store3(work, w + at.W_VEL, ZERO)
