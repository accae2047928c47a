"""Inertia of a deformed body from its moments, and the forces its motion and its strain call up (THEORY section 3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.layout import W_A, W_OMEGA, W_P, W_Q, W_S
from femflex.dynamics.vectors import Matrix, Vector, add, cross, inner, load3, load9, scale, store3, sub, turn

Array = NDArray[np.float64]
Record = np.void


@inner
def contract(P: Array, delta: Array, Z: Array) -> None:
    """Z = P_0 + sum_k delta_k P_k with P (1 + n, size), Z (size,); four shapes a pass, to spare trips to memory."""
    n, size = delta.size, Z.size
    for j in range(size):
        Z[j] = P[j]
    k = 0
    while k + 4 <= n:
        a, b, c, d = delta[k], delta[k + 1], delta[k + 2], delta[k + 3]
        Pa = P[(k + 1) * size : (k + 2) * size]
        Pb = P[(k + 2) * size : (k + 3) * size]
        Pc = P[(k + 3) * size : (k + 4) * size]
        Pd = P[(k + 4) * size : (k + 5) * size]
        for j in range(size):
            Z[j] += a * Pa[j] + b * Pb[j] + c * Pc[j] + d * Pd[j]
        k += 4
    while k < n:
        a = delta[k]
        Pa = P[(k + 1) * size : (k + 2) * size]
        for j in range(size):
            Z[j] += a * Pa[j]
        k += 1


@inner
def deform(b: Record, x: Array, pool: Array, work: Array) -> None:
    """Write the first moment s y, the second moment Q, the half-contracted Z, the inertia A (6, 6) and coupling B (6, n).

    Z[a, k, c] = P[A, a, k, c] y_A. A holds (mass, s y, J), B holds (s_k, Cr) of the kinetic energy in THEORY section 3.
    """
    w, n = b["work"], b["n"]
    row = 3 * (1 + n)
    delta = x[b["qe"] : b["qe"] + n]
    s = pool[b["first"] : b["first"] + row]
    Z = work[b["Z"] : b["Z"] + 3 * row]
    contract(pool[b["second"] : b["second"] + 3 * row * (1 + n)], delta, Z)
    B = work[b["B"] : b["B"] + 6 * n]
    sx, sy, sz = s[0], s[1], s[2]
    for k in range(n):
        d = delta[k]
        kx, ky, kz = s[3 * k + 3], s[3 * k + 4], s[3 * k + 5]
        sx += d * kx
        sy += d * ky
        sz += d * kz
        B[k], B[n + k], B[2 * n + k] = kx, ky, kz
    store3(work, w + W_S, (sx, sy, sz))
    Zx, Zy, Zz = Z[:row], Z[row : 2 * row], Z[2 * row :]
    for k in range(n):
        j = 3 * k + 3
        B[3 * n + k] = Zy[j + 2] - Zz[j + 1]
        B[4 * n + k] = Zz[j] - Zx[j + 2]
        B[5 * n + k] = Zx[j + 1] - Zy[j]
    store3(work, w + W_Q, moved(Zx, delta))
    store3(work, w + W_Q + 3, moved(Zy, delta))
    store3(work, w + W_Q + 6, moved(Zz, delta))
    write_rigid_inertia(w, pool[b["mass"]], work)


@inner
def moved(rows: Array, delta: Array) -> Vector:
    """rows[0] + sum_k delta_k rows[k + 1], rows (1 + n, 3) laid flat."""
    x, y, z = rows[0], rows[1], rows[2]
    for k in range(delta.size):
        x += delta[k] * rows[3 * k + 3]
        y += delta[k] * rows[3 * k + 4]
        z += delta[k] * rows[3 * k + 5]
    return x, y, z


@inner
def write_rigid_inertia(w: int, m: float, work: Array) -> None:
    """Write A = [[m 1, -skew(s)], [skew(s), J]] (6, 6) from the mass and the moments in the work block."""
    s = load3(work, w + W_S)
    Q = load9(work, w + W_Q)
    trace = Q[0] + Q[4] + Q[8]
    A = w + W_A
    for j in range(36):
        work[A + j] = 0.0
    work[A], work[A + 7], work[A + 14] = m, m, m
    work[A + 4], work[A + 5] = s[2], -s[1]
    work[A + 9], work[A + 11] = -s[2], s[0]
    work[A + 15], work[A + 16] = s[1], -s[0]
    work[A + 24], work[A + 30] = s[2], -s[1]
    work[A + 19], work[A + 31] = -s[2], s[0]
    work[A + 20], work[A + 26] = s[1], -s[0]
    for a in range(3):
        for c in range(3):
            work[A + 21 + 6 * a + c] = (trace if a == c else 0.0) - Q[3 * a + c]


@inner
def write_velocity_forces(
    b: Record, x: Array, nq: int, pool: Array, work: Array, field: Matrix, uniform: Vector
) -> None:
    """Write the bias wrench p (6) and elastic bias pn (n): velocity terms of THEORY section 3 less a linear field.

    field F (3, 3) symmetric and uniform b (3): the body feels the acceleration -(F r + b), body components, r from its
    origin; they ride along with W = omega omega^T - |omega|^2 1 at no cost.
    """
    w, n = b["work"], b["n"]
    Z, row = b["Z"], 3 * (1 + b["n"])
    o = load3(work, w + W_OMEGA)
    s = load3(work, w + W_S)
    Q = load9(work, w + W_Q)
    square = o[0] * o[0] + o[1] * o[1] + o[2] * o[2]
    W: Matrix = (
        o[0] * o[0] - square + field[0], o[0] * o[1] + field[1], o[0] * o[2] + field[2],
        o[1] * o[0] + field[3], o[1] * o[1] - square + field[4], o[1] * o[2] + field[5],
        o[2] * o[0] + field[6], o[2] * o[1] + field[7], o[2] * o[2] - square + field[8],
    )  # fmt: skip
    m = pool[b["mass"]]
    force = add(turn(W, s), scale(m, uniform))
    couple = cross(s, uniform)
    # int r x W r: eps_abc (W Q)_cb
    WQ = (
        turn(W, (Q[0], Q[3], Q[6])),  # columns of W Q
        turn(W, (Q[1], Q[4], Q[7])),
        turn(W, (Q[2], Q[5], Q[8])),
    )
    couple = add(couple, (WQ[1][2] - WQ[2][1], WQ[2][0] - WQ[0][2], WQ[0][1] - WQ[1][0]))
    if n > 0:
        du = x[nq + b["ue"] : nq + b["ue"] + n]
        first = pool[b["first"] : b["first"] + 3 * (1 + n)]
        Zx, Zy, Zz = work[Z : Z + row], work[Z + row : Z + 2 * row], work[Z + 2 * row : Z + 3 * row]
        ds = sub(moved(first, du), (first[0], first[1], first[2]))
        Sx = sub(moved(Zx, du), (Zx[0], Zx[1], Zx[2]))  # S_ac = int r_a rdot_c
        Sy = sub(moved(Zy, du), (Zy[0], Zy[1], Zy[2]))
        Sz = sub(moved(Zz, du), (Zz[0], Zz[1], Zz[2]))
        force = add(force, scale(2.0, cross(o, ds)))
        S_o = add(scale(o[0], Sx), add(scale(o[1], Sy), scale(o[2], Sz)))
        couple = add(couple, scale(2.0, sub(scale(Sx[0] + Sy[1] + Sz[2], o), S_o)))
        gyro = pool[b["gyro"] : b["gyro"] + 3 * n * n]
        write_shape_forces(work[b["pn"] : b["pn"] + n], du, o, W, uniform, first, gyro, Zx, Zy, Zz)
    store3(work, w + W_P, force)
    store3(work, w + W_P + 3, couple)


@inner
def write_shape_forces(
    pn: Array,
    du: Array,
    o: Vector,
    W: Matrix,
    uniform: Vector,
    first: Array,
    gyro: Array,
    Zx: Array,
    Zy: Array,
    Zz: Array,
) -> None:
    """pn_k = W_ab Z[b, k, a] + 2 omega_a R1[j, a, k] du_j + uniform . s_k."""
    n = pn.size
    for k in range(n):
        j = 3 * k + 3
        pn[k] = (
            W[0] * Zx[j] + W[1] * Zx[j + 1] + W[2] * Zx[j + 2]
            + W[3] * Zy[j] + W[4] * Zy[j + 1] + W[5] * Zy[j + 2]
            + W[6] * Zz[j] + W[7] * Zz[j + 1] + W[8] * Zz[j + 2]
            + uniform[0] * first[j] + uniform[1] * first[j + 1] + uniform[2] * first[j + 2]
        )  # fmt: skip
    for j in range(n):
        d = 2.0 * du[j]
        gx, gy, gz = d * o[0], d * o[1], d * o[2]
        row = gyro[3 * n * j : 3 * n * (j + 1)]
        rx, ry, rz = row[:n], row[n : 2 * n], row[2 * n :]
        for k in range(n):
            pn[k] += gx * rx[k] + gy * ry[k] + gz * rz[k]


@inner
def add_elastic_forces(b: Record, x: Array, nq: int, pool: Array, work: Array) -> None:
    """Add f0 + V1 delta + D ddelta to the elastic bias pn (eq. 8)."""
    n = b["n"]
    delta, rate = x[b["qe"] : b["qe"] + n], x[nq + b["ue"] : nq + b["ue"] + n]
    pn, f0 = work[b["pn"] : b["pn"] + n], pool[b["f0"] : b["f0"] + n]
    K, D = pool[b["stiffness"] : b["stiffness"] + n * n], pool[b["damping"] : b["damping"] + n * n]
    if b["diagonal"]:
        for k in range(n):
            pn[k] += f0[k] + K[k * (n + 1)] * delta[k] + D[k * (n + 1)] * rate[k]
        return
    for k in range(n):
        K_k, D_k = K[k * n : (k + 1) * n], D[k * n : (k + 1) * n]
        total = f0[k]
        for j in range(n):
            total += K_k[j] * delta[j] + D_k[j] * rate[j]
        pn[k] += total


@inner
def zero_forces(b: Record, work: Array) -> None:
    """Clear the bias wrench and the elastic bias."""
    for j in range(6):
        work[b["work"] + W_P + j] = 0.0
    for k in range(b["n"]):
        work[b["pn"] + k] = 0.0


@inner
def accelerate_uniformly(b: Record, a: Vector, pool: Array, work: Array) -> None:
    """Add the inertia forces of a uniform acceleration a (3), body components, to p and pn."""
    w = b["work"]
    s = load3(work, w + W_S)
    m = pool[b["mass"]]
    for j in range(3):
        work[w + W_P + j] += m * a[j]
    c = cross(s, a)
    for j in range(3):
        work[w + W_P + 3 + j] += c[j]
    for k in range(b["n"]):
        at = b["first"] + 3 * (k + 1)
        work[b["pn"] + k] += a[0] * pool[at] + a[1] * pool[at + 1] + a[2] * pool[at + 2]
