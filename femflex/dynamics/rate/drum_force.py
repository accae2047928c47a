"""Compiled force of the drum of a deploying body (see `femflex.dynamics.observe.drum`), for free lengths.

Everything is read at a state whose accelerations and joint wrenches were gathered last. The block of a unit rate of the
length stands at `unit`, laid out as the body's own; `off` leads from a place in the one to that in the other.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.inertia import gradient, twist_of
from femflex.dynamics.bodies.shapes import combined
from femflex.dynamics.bodies.varying import DRIFT, FLOW, SPEED
from femflex.dynamics.forces.gravity import gravity_field, local_field
from femflex.dynamics.layout.records import (
    ORBIT_NONE,
    ORBIT_SPECIFIED,
    VARIES,
    W_ACC,
    W_CIN,
    W_CIP,
    W_OMEGA,
    W_P,
    W_R,
    body_of,
    header_of,
)
from femflex.dynamics.layout.variations import WORKED
from femflex.kernels.compiled import inner
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
    turn,
    turn_back,
)
from femflex.system.variation import COLUMNS


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
    if head["orbit"] != ORBIT_NONE:
        l, strength = gravity_field(table, pool, work)
    field, uniform = local_field(b, head, l, strength, pool, work)
    a = add(load3(work, w + W_ACC), uniform)
    if head["orbit"] == ORBIT_SPECIFIED:
        a = sub(a, turn(load9(work, w + W_CIN), load3(work, head["total"] + 3)))
    return a, field


@inner
def moving_force(b: Record, shift: int, table: Table, pool: Array, work: Array) -> float:
    """int chi . (a - f) dm without the material's own acceleration at constant coordinates."""
    n, wide, delta, ddelta, w = b["n_shapes"], b["wide"], b["delta"], b["ddelta"], b["work"]
    rates, accel = b["rates"] + shift, b["accel_all"]
    a, field = effective_acceleration(b, table, pool, work)
    omega, alpha = load3(work, w + W_OMEGA), load3(work, w + W_ACC + 4)
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
def joint_force_at_P(child: Record, parent: Record, shift: int, pool: Array, work: Array) -> float:
    """Return the joint's force on the velocity of marker P (on the deploying parent) per rate of the length."""
    w = child["work"]
    C = load_rows(work, w + W_CIP)
    force, torque = turn_back(C, load3(work, w + W_P)), turn_back(C, load3(work, w + W_P + 4))
    wide, delta, marker = parent["wide"], parent["delta"], child["place"] + shift
    shape, spin = child["shape"] + shift, child["spin"] + shift
    velocity = add(load3(pool, marker + 16), combined(pool, shape + 3 * wide, wide, work, delta))
    theta = combined(pool, child["spin"], wide, work, delta)
    _, _, rate, _ = moving_vector_turn(theta, combined(pool, spin + 3 * wide, wide, work, delta))
    r_P = add(load3(pool, child["place"]), combined(pool, child["shape"], wide, work, delta))
    arm = sub(load3(work, w + W_R), r_P)
    return dot(force, velocity) + dot(add(torque, cross(arm, force)), rate)


@inner
def joint_force_at_Q(b: Record, shift: int, pool: Array, work: Array) -> float:
    """Return the force of the body's own joint on the velocity of its marker Q per rate of the length."""
    w, wide, delta = b["work"], b["wide"], b["delta"]
    force, torque = load3(work, w + W_P), load3(work, w + W_P + 4)
    shape, spin = b["own_shape"] + shift, b["own_spin"] + shift
    velocity = add(load3(pool, b["own_place"] + shift + 16), combined(pool, shape + 3 * wide, wide, work, delta))
    theta = combined(pool, b["own_spin"], wide, work, delta)
    _, _, rate, _ = moving_vector_turn(theta, combined(pool, spin + 3 * wide, wide, work, delta))
    r_Q = add(load3(pool, b["own_place"]), combined(pool, b["own_shape"], wide, work, delta))
    return -dot(force, velocity) - dot(sub(torque, cross(r_Q, force)), rate)


@inner
def stiffness_force(b: Record, shift: int, pool: Array, work: Array) -> float:
    """dV/dL at fixed coordinates."""
    n, row, delta = b["n"], b["row"], b["delta"]
    V1 = b["stiffness"] + shift + n * row + row  # rates stand behind V1 and f0
    force = 0.0
    for j in range(n):
        for k in range(n):
            force += 0.5 * work[delta + j] * pool[V1 + row * j + k] * work[delta + k]
    return force


@inner
def strain_force(b: Record, table_start: int, pool: Array, work: Array) -> float:
    """dV/dL at fixed coordinates of the energy of V2 and V3, whose rates stand in a `strain_table` at the place."""
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
def drum_force(i: int, rate: float, acceleration: float, pickup: int, table: Table, pool: Array, work: Array) -> float:
    """Force of the drum of body i at the gathered state; pickup: place of its part in the block of unit rate."""
    b = body_of(table, i)
    shift = b["unit"] - b["block"]
    complete_accelerations(b, work)
    n, wide = b["n_shapes"], b["wide"]
    force = moving_force(b, shift, table, pool, work)
    speeds, zero = b["speeds"] + shift, pool[b["rates"] + shift + SPEED]
    force += 2.0 * rate * bilinear_form(pool, speeds, zero, b, work, b["ddelta"], 0.0)
    force += acceleration * bilinear_form(pool, speeds, zero, b, work, b["delta"], 1.0)
    speed_rates, zero = speeds + (1 + n) * wide, pool[b["rates"] + shift + SPEED + 1]
    force += 0.5 * rate * rate * bilinear_form(pool, speed_rates, zero, b, work, b["delta"], 1.0)
    if pickup >= 0:
        kappa = bilinear_form(pool, pickup + 4, pool[pickup], b, work, b["delta"], 1.0)
        force += 0.5 * rate * abs(rate) * kappa
    if n > 0:
        force += stiffness_force(b, shift, pool, work)
    if b["own_bends"] >= VARIES:
        force += joint_force_at_Q(b, shift, pool, work)
    force -= pool[b["unit"] - WORKED]
    for k in range(i + 1, header_of(table)["n_bodies"]):
        child = body_of(table, k)
        if child["parent"] == i and child["bends"] >= VARIES:
            force += joint_force_at_P(child, b, shift, pool, work)
    return force
