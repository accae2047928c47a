"""Inertia of a deformed body from its moments, and the forces its motion and its strain call up (THEORY section 3)."""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.bodies.shapes import put_rows9, rows3, rows9, totals3, zero_rows3, zero_rows9
from femflex.dynamics.bodies.slaves import add_drift_forces
from femflex.dynamics.bodies.stiffening import add_varying_force, write_varying_stiffness
from femflex.dynamics.layout.records import W_OMEGA, W_P, W_Q, W_S
from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import Lane, Lanes, lane, plus, put_lane, total, zero_lane
from femflex.kernels.pairs import dot_four_rows, pair_of
from femflex.kernels.vectors import (
    ZERO,
    Matrix,
    Vector,
    add,
    add9,
    cross,
    dot,
    load3,
    load9,
    scale,
    store3,
    store9,
    store_lane,
    transpose,
    turn,
    turn_back,
)


@inner
def deform(b: Record, pool: Array, work: Array) -> None:
    """Write the first moment s y, the second moment Q, and for flexible bodies the half-contracted Z.

    Z[a,c,k] = P[A,a,k,c] y_A and Q[a,c] = P[A,a,B,c] y_A y_B with y = (1, delta); the position rho is A = 0.
    """
    w, n, row = b["work"], b["n_shapes"], b["wide"]
    s, Q = load3(pool, b["mass"] + 1), load9(pool, b["mass"] + 4)
    if n > 0:
        P, delta = b["second"], b["delta"]
        ds, dQ = zero_rows3(), zero_rows9()
        for k in range(0, row, 4):
            start = rows9(pool, P + k, row)
            z = start
            for j in range(n):
                z = plus(z, work[delta + j], rows9(pool, P + 9 * row * (j + 1) + k, row))
            put_rows9(work, b["Z"] + k, row, z)
            d = lane(work, delta + k)
            ds = plus(ds, d, rows3(pool, b["first"] + k, row))
            dQ = plus(dQ, d, add9(z, transpose(start)))
        s, Q = add(s, totals3(ds)), add9(Q, totals9(dQ))
    store3(work, w + W_S, s)
    store9(work, w + W_Q, Q)


@formula
def totals9(m: Lanes) -> Matrix:
    """Sum over the four shapes of each component."""
    return tuple(total(part) for part in m)  # type: ignore[return-value]


@formula
def gradient(omega: Vector, field: Matrix) -> Matrix:
    """W = omega omega^T - |omega|^2 1 + F, symmetric."""
    x, y, z = omega
    return (
        field[0] - y * y - z * z, field[1] + x * y, field[2] + x * z,
        field[3] + x * y, field[4] - x * x - z * z, field[5] + y * z,
        field[6] + x * z, field[7] + y * z, field[8] - x * x - y * y,
    )  # fmt: skip


@formula
def twist_of(m: Matrix) -> Vector:
    """eps_abc m_bc."""
    return m[5] - m[7], m[6] - m[2], m[1] - m[3]


@formula
def product_of_symmetric(Q: Matrix, W: Matrix) -> Matrix:
    """Q W for symmetric W, row by row."""
    rows = [turn(W, (Q[3 * a], Q[3 * a + 1], Q[3 * a + 2])) for a in range(3)]
    return (*rows[0], *rows[1], *rows[2])


@inner
def write_velocity_forces(b: Record, pool: Array, work: Array, field: Matrix, uniform: Vector) -> None:
    """Write the bias wrench p (6) and elastic bias pn (n): velocity terms of THEORY section 3 less a linear field.

    field F (3, 3) symmetric and uniform b (3): the body feels the acceleration -(F r + b), body components, r from its
    origin; they ride along with W = omega omega^T - |omega|^2 1 at no cost.
    """
    w, n, row = b["work"], b["n_shapes"], b["wide"]
    omega, s, Q, m = load3(work, w + W_OMEGA), load3(work, w + W_S), load9(work, w + W_Q), pool[b["mass"]]
    W = gradient(omega, field)
    force = add(turn(W, s), scale(m, uniform))
    couple = add(cross(s, uniform), twist_of(product_of_symmetric(Q, W)))  # int r x (W r + b)
    if n > 0:
        ds, S = zero_rows3(), zero_rows9()  # S_ac = int r_a rdot_c
        for k in range(0, row, 4):
            d, first, z = lane(work, b["ddelta"] + k), rows3(pool, b["first"] + k, row), rows9(work, b["Z"] + k, row)
            ds, S = plus(ds, d, first), plus(S, d, z)
            gyro = zero_rows3()
            for j in range(n):
                gyro = plus(gyro, work[b["ddelta"] + j], rows3(pool, b["gyro"] + 3 * row * j + k, row))
            put_lane(work, b["pn"] + k, shape_forces(W, z, omega, gyro, uniform, first))
        force = add(force, scale(2.0, cross(omega, totals3(ds))))
        couple = add(couple, scale(2.0, coriolis_couple(omega, totals9(S))))
    store_lane(work, w + W_P, force)
    store_lane(work, w + W_P + 4, couple)
    if b["n_slaves"]:
        add_drift_forces(b, pool, work)


@formula
def coriolis_couple(omega: Vector, S: Matrix) -> Vector:
    """int r x (omega x rdot) dm = tr(S) omega - S^T omega."""
    return add(scale(S[0] + S[4] + S[8], omega), scale(-1.0, turn_back(S, omega)))


@formula
def shape_forces(W: Matrix, z: Lanes, omega: Vector, gyro: Lanes, uniform: Vector, first: Lanes) -> Lane:
    """pn_k = W_ac Z[a,c,k] + 2 omega_a R1[j,a,k] ddelta_j + uniform . s_k of four shapes."""
    tensor = W[0] * z[0]
    for j in range(1, 9):
        tensor = tensor + W[j] * z[j]
    return tensor + dot(scale(2.0, omega), gyro) + dot(uniform, first)


@inner
def add_elastic_forces(b: Record, pool: Array, work: Array) -> None:
    """Add f0 + V1 delta + 3 V2 dd + 2 V3 ddd + D ddelta to the elastic bias pn (eq. 8)."""
    n, row = b["n"], b["row"]
    delta, ddelta = b["delta"], b["ddelta"]
    for k in range(0, row, 4):
        force = lane(work, b["pn"] + k) + lane(pool, b["f0"] + k)
        if b["diagonal"]:
            force = force + lane(pool, b["own_stiffness"] + k) * lane(work, delta + k)
            force = force + lane(pool, b["own_damping"] + k) * lane(work, ddelta + k)
        else:
            for j in range(n):
                force = force + work[delta + j] * lane(pool, b["stiffness"] + row * j + k)
                force = force + work[ddelta + j] * lane(pool, b["damping"] + row * j + k)
        put_lane(work, b["pn"] + k, force)
    if b["nonlinear"]:
        write_varying_stiffness(b, pool, work, 3.0, 2.0)
        add_varying_force(b, work, work, b["delta"], 1.0, work, b["pn"], 1)


@inner
def zero_forces(b: Record, work: Array) -> None:
    """Clear the bias wrench and the elastic bias."""
    store_lane(work, b["work"] + W_P, ZERO)
    store_lane(work, b["work"] + W_P + 4, ZERO)
    for k in range(0, b["wide"], 4):
        put_lane(work, b["pn"] + k, zero_lane())


@inner
def accelerate_uniformly(b: Record, a: Vector, pool: Array, work: Array) -> None:
    """Add the inertia forces of a uniform acceleration a (3), body components, to p and pn; the border is written."""
    w, row, stride = b["work"], b["row"], b["stride"]
    p, couple = w + W_P, cross(load3(work, w + W_S), a)
    store_lane(work, p, add(load3(work, p), scale(pool[b["mass"]], a)))
    store_lane(work, p + 4, add(load3(work, p + 4), couple))
    for k in range(0, row, 4):
        coupling = dot_four_rows(work, b["border"] + stride * k + row, stride, pair_of(a, ZERO))
        put_lane(work, b["pn"] + k, lane(work, b["pn"] + k) + coupling)
