"""Compiled force of the drum of a deploying body, and power of the change of a body that varies.

The force is derived in `femflex.dynamics.observe.drum`, the power in `femflex.dynamics.observe.variations`.

Everything is read at a state whose accelerations and joint wrenches were gathered last. The block of a unit rate of the
length stands at `unit`, laid out as the body's own; `off` leads from a place in the one to that in the other.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.inertia import gradient, twist_of
from femflex.dynamics.bodies.shapes import combined
from femflex.dynamics.bodies.varying import DRIFT, FLOW, SPEED
from femflex.dynamics.forces.gravity import gravity_field, local_field
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.records import body_of, header_of
from femflex.dynamics.layout.variations import WORKED
from femflex.kernels.compiled import inner
from femflex.kernels.entries import INTEGER, POINTERS, REAL, caller, entry
from femflex.kernels.turns import moving_vector_turn
from femflex.kernels.vectors import (
    ZERO,
    Matrix,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    load_rows,
    scale,
    sub,
    transpose,
    turn,
    turn_back,
)
from femflex.system.variation import COLUMNS

DRUM_FORCE = REAL(INTEGER, REAL, REAL, *POINTERS)
call_drum_force = caller(DRUM_FORCE)


@inner
def complete_accelerations(b: Record, work: Array) -> None:
    """Add the accelerations of slaved shapes after those of the coordinates, at work[b["accel_all"]] (wide)."""
    n, row = b["n"], b["row"]
    for k in range(b["wide"]):
        work[b["accel_all"] + k] = work[b["accel"] + k] if k < n else 0.0
    for s in range(b["n_slaves"]):
        value = work[b["drift"] + n + s]
        for k in range(n):
            value += work[b["tie"] + s * row + k] * work[b["accel"] + k]
        work[b["accel_all"] + n + s] = value


@inner
def bilinear_form(pool: Array, table_start: int, zero: float, b: Record, work: Array, x: int, first: float) -> float:
    """y . S . x with y = (1, delta), x = (first, work[x:]): S over (rho, shapes) stands without its first column."""
    n, wide, delta = b["n_shapes"], b["wide"], b["delta"]
    total = zero * first
    for k in range(n):
        total += pool[table_start + k] * work[x + k]
        total += pool[table_start + k] * work[delta + k] * first
        for j in range(n):
            total += work[delta + j] * pool[table_start + wide * (j + 1) + k] * work[x + k]
    return total


@inner
def effective_acceleration(b: Record, table: Table, pool: Array, work: Array) -> tuple[Vector, Matrix]:
    """Acceleration of the body's origin less gravity there, and the gradient F, body components."""
    head, w = header_of(table), b["work"]
    l, strength = ZERO, 0.0
    if head["orbit"] != at.ORBIT_NONE:
        l, strength = gravity_field(table, pool, work)
    field, uniform = local_field(b, head, l, strength, pool, work)
    a = add(load3(work, w + at.W_ACC), uniform)
    if head["orbit"] == at.ORBIT_SPECIFIED:
        a = sub(a, turn(load9(work, w + at.W_CIN), load3(work, head["total"] + 3)))
    return a, field


@inner
def moving_force(b: Record, shift: int, table: Table, pool: Array, work: Array) -> float:
    """int chi . (a - f) dm without the material's own acceleration at constant coordinates."""
    n, wide, delta, ddelta, w = b["n_shapes"], b["wide"], b["delta"], b["ddelta"], b["work"]
    rates, accel = b["rates"] + shift, b["accel_all"]
    a, field = effective_acceleration(b, table, pool, work)
    omega, alpha = load3(work, w + at.W_OMEGA), load3(work, w + at.W_ACC + 4)
    drift, flow = load3(pool, rates + DRIFT), load9(pool, rates + FLOW)
    W = gradient(omega, field)
    coriolis, force = ZERO, 0.0
    for k in range(n):
        d = work[delta + k]
        drift = add(drift, scale(d, column3(pool, b["drifts"] + shift + k, wide)))
        Z = column9(pool, b["flow"] + shift + k, wide)
        for j in range(n):
            second = column9(pool, b["flow"] + shift + 9 * wide * (j + 1) + k, wide)
            Z = sum9(Z, work[delta + j], second)
        flow = sum9(sum9(flow, d, Z), d, column9(pool, b["flow0"] + shift + k, wide))
        coriolis = add(coriolis, scale(work[ddelta + k], twist_of(Z)))
        force += (Z[0] + Z[4] + Z[8]) * work[accel + k]
    force += dot(drift, a) + dot(alpha, twist_of(flow)) + 2.0 * dot(omega, coriolis)
    for i in range(3):
        for j in range(3):
            force += W[3 * i + j] * flow[3 * j + i]
    return force


@inner
def column3(a: Array, i: int, wide: int) -> Vector:
    """One shape of three rows."""
    return a[i], a[i + wide], a[i + 2 * wide]


@inner
def column9(a: Array, i: int, wide: int) -> Matrix:
    """One shape of nine rows."""
    return (
        a[i], a[i + wide], a[i + 2 * wide], a[i + 3 * wide], a[i + 4 * wide],
        a[i + 5 * wide], a[i + 6 * wide], a[i + 7 * wide], a[i + 8 * wide],
    )  # fmt: skip


@inner
def sum9(m: Matrix, s: float, n: Matrix) -> Matrix:
    """m + s n."""
    return (
        m[0] + s * n[0], m[1] + s * n[1], m[2] + s * n[2],
        m[3] + s * n[3], m[4] + s * n[4], m[5] + s * n[5],
        m[6] + s * n[6], m[7] + s * n[7], m[8] + s * n[8],
    )  # fmt: skip


@inner
def marker_force(
    b: Record,
    wrench: tuple[Vector, Vector],
    place: Vector,
    marker: tuple[int, int, int],
    shift: int,
    pool: Array,
    work: Array,
) -> float:
    """Force of a joint's force and torque about a place on the velocity of a marker per rate of the length.

    All in components of the body b; marker: where its place, phi and psi stand.
    """
    (force, torque), wide, delta, (position, shape, spin) = wrench, b["wide"], b["delta"], marker
    velocity = combined(pool, shape + shift + 3 * wide, wide, work, delta)
    velocity = add(load3(pool, position + shift + 16), velocity)
    theta = combined(pool, spin, wide, work, delta)
    _, _, rate, _ = moving_vector_turn(theta, combined(pool, spin + shift + 3 * wide, wide, work, delta))
    arm = sub(place, add(load3(pool, position), combined(pool, shape, wide, work, delta)))
    return dot(force, velocity) + dot(add(torque, cross(arm, force)), rate)


@inner
def stiffness_force(b: Record, shift: int, pool: Array, work: Array) -> float:
    """dV/dL, or dV/dt, at fixed coordinates, of the energy of V1 and f0."""
    n, row, delta, V1, f0 = b["n"], b["row"], b["delta"], b["stiffness_rate"] + shift, b["f0_rate"] + shift
    force = 0.0
    for j in range(n):
        force += work[delta + j] * pool[f0 + j]
        for k in range(n):
            force += 0.5 * work[delta + j] * pool[V1 + row * j + k] * work[delta + k]
    return force


@inner
def strain_force(b: Record, table_start: int, pool: Array, work: Array) -> float:
    """dV/dL, or dV/dt, at fixed coordinates of the energy of V2 and V3, whose rates stand in a `strain_table`."""
    n, delta = b["n"], b["delta"]
    count = n + n * (n + 1) // 2
    force, entry = 0.0, 0
    for k in range(n):
        for l in range(k, n):
            first = table_start + COLUMNS * count * (entry // COLUMNS) + entry % COLUMNS
            K, m = 0.0, n
            for i in range(n):
                d = work[delta + i]
                K += 2.0 * d * pool[first + COLUMNS * i]
                for j in range(i, n):
                    K += d * work[delta + j] * pool[first + COLUMNS * m]
                    m += 1
            force += (0.5 if l == k else 1.0) * K * work[delta + k] * work[delta + l]
            entry += 1
    return force


@inner
def joint_forces(i: int, shift: int, table: Table, pool: Array, work: Array) -> float:
    """Force of the joints of body i on the velocities that their markers have in it per rate of the length."""
    b, force = body_of(table, i), 0.0
    if b["own_bends"] >= at.VARIES:
        wrench = load3(work, b["work"] + at.W_P), load3(work, b["work"] + at.W_P + 4)
        force -= marker_force(b, wrench, ZERO, (b["own_place"], b["own_shape"], b["own_spin"]), shift, pool, work)
    for k in range(i + 1, header_of(table)["n_bodies"]):
        child = body_of(table, k)
        if child["parent"] == i and child["bends"] >= at.VARIES:
            w = child["work"]
            C = load_rows(work, w + at.W_CIP)
            wrench = turn_back(C, load3(work, w + at.W_P)), turn_back(C, load3(work, w + at.W_P + 4))
            marker = child["place"], child["shape"], child["spin"]
            force += marker_force(b, wrench, load3(work, w + at.W_R), marker, shift, pool, work)
    return force


@inner
def strain_forces(b: Record, shift: int, pool: Array, work: Array) -> float:
    """dV/dL, or dV/dt, at fixed coordinates."""
    force = 0.0
    if b["stiffness_rate"] > 0:
        force += stiffness_force(b, shift, pool, work)
    if b["strain_rate"] > 0:
        force += strain_force(b, b["strain_rate"] + shift, pool, work)
    return force


@inner
def half_speed_rate(b: Record, shift: int, pool: Array, work: Array) -> float:
    """Half of the rate of int w . w dm at fixed coordinates."""
    rates, zero = b["speeds"] + shift + (1 + b["n_shapes"]) * b["wide"], pool[b["rates"] + shift + SPEED + 1]
    return 0.5 * bilinear_form(pool, rates, zero, b, work, b["delta"], 1.0)


@inner
def exit_density(b: Record, pool: Array, work: Array) -> float:
    """m' |chi_A y_A|^2 at the exit, in the block of unit rate [kg/m]."""
    if b["pickup"] == 0:
        return 0.0
    pickup = b["pickup"] + b["unit"] - b["block"]
    return bilinear_form(pool, pickup + 4, pool[pickup], b, work, b["delta"], 1.0)


@entry(DRUM_FORCE)
def drum_force(i: int, rate: float, acceleration: float, table: Table, pool: Array, work: Array) -> float:
    """Force of the drum of body i at the gathered state."""
    b = body_of(table, i)
    shift = b["unit"] - b["block"]
    complete_accelerations(b, work)
    force = strain_forces(b, shift, pool, work) + joint_forces(i, shift, table, pool, work) - pool[b["unit"] - WORKED]
    if b["flows"]:
        speeds, zero = b["speeds"] + shift, pool[b["rates"] + shift + SPEED]
        force += moving_force(b, shift, table, pool, work)
        force += 2.0 * rate * bilinear_form(pool, speeds, zero, b, work, b["ddelta"], 0.0)
        force += acceleration * bilinear_form(pool, speeds, zero, b, work, b["delta"], 1.0)
        force += rate * rate * half_speed_rate(b, shift, pool, work)
        force += 0.5 * rate * abs(rate) * exit_density(b, pool, work)
    return force


@inner
def change_power(i: int, table: Table, pool: Array, work: Array) -> float:
    """Power of the change of body i at the gathered state [W], from its own block, but for that of arriving mass."""
    b = body_of(table, i)
    complete_accelerations(b, work)
    power = strain_forces(b, 0, pool, work) + joint_forces(i, 0, table, pool, work)
    if b["flows"]:
        zero = pool[b["rates"] + SPEED]
        power += moving_force(b, 0, table, pool, work) + half_speed_rate(b, 0, pool, work)
        power += 2.0 * bilinear_form(pool, b["speeds"], zero, b, work, b["ddelta"], 0.0)
    return power


@inner
def growth_power(b: Record, g: Vector, pool: Array, work: Array) -> float:
    """Half of int v.v over the mass that arrives in a unit of time, and its weight's energy in the field g [W]."""
    start, n, wide, w = b["growth"], b["n_shapes"], b["wide"], b["work"]
    first, second, delta, ddelta = start + 16, start + 16 + 3 * wide, b["delta"], b["ddelta"]
    s, Q, ds, h, elastic = load3(pool, start + 1), load9(pool, start + 4), ZERO, ZERO, 0.0
    for k in range(n):
        s_k = column3(pool, first + k, wide)
        s, ds = add(s, scale(work[delta + k], s_k)), add(ds, scale(work[ddelta + k], s_k))
        P0 = column9(pool, second + k, wide)
        P = P0
        for j in range(n):
            P_j = column9(pool, second + 9 * wide * (j + 1) + k, wide)
            P = sum9(P, work[delta + j], P_j)
            elastic += 0.5 * work[ddelta + j] * (P_j[0] + P_j[4] + P_j[8]) * work[ddelta + k]
        Q = sum9(sum9(Q, work[delta + k], P), work[delta + k], transpose(P0))
        h = add(h, scale(work[ddelta + k], twist_of(P)))
    mass, v, omega = pool[start], load3(work, w + at.W_VEL), load3(work, w + at.W_OMEGA)
    J_omega = sub(scale(Q[0] + Q[4] + Q[8], omega), turn(Q, omega))
    motion = 0.5 * mass * dot(v, v) + dot(v, add(cross(omega, s), ds)) + 0.5 * dot(omega, J_omega) + dot(omega, h)
    place = add(scale(mass, load3(work, w + at.W_POS)), turn_back(load9(work, w + at.W_CIN), s))
    return motion + elastic - dot(g, place)
