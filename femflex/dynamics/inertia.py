"""Inertia of a deformed body from its moments, and the forces its motion and its strain call up (THEORY section 3)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from femflex.dynamics.layout import W_A, W_OMEGA, W_P, W_Q, W_S
from femflex.dynamics.vectors import FAST, Matrix, Vector, add, cross, load3, load9, scale, store3, store9, turn

Array = NDArray[np.float64]
Record = np.void


@njit(cache=True, fastmath=FAST)
def deform(b: Record, x: Array, pool: Array, work: Array) -> None:
    """Write the first moment s y, the second moment Q, the half-contracted Z, the inertia A (6, 6) and coupling B (6, n).

    Z[a, k, c] = P[A, a, k, c] y_A. A holds (mass, s y, J), B holds (s_k, Cr) of the kinetic energy in THEORY section 3.
    """
    w, n = b["work"], b["n"]
    Z, B, row = b["Z"], b["B"], 3 * (1 + b["n"])
    first, second = b["first"], b["second"]
    sx, sy, sz = pool[first], pool[first + 1], pool[first + 2]
    for j in range(3 * row):
        work[Z + j] = pool[second + j]
    for k in range(n):
        d = x[b["qe"] + k]
        at = first + 3 * (k + 1)
        sx += d * pool[at]
        sy += d * pool[at + 1]
        sz += d * pool[at + 2]
        source = second + 3 * row * (k + 1)
        for j in range(3 * row):
            work[Z + j] += d * pool[source + j]
    store3(work, w + W_S, (sx, sy, sz))
    for a in range(3):
        q0, q1, q2 = work[Z + a * row], work[Z + a * row + 1], work[Z + a * row + 2]
        for k in range(n):
            d = x[b["qe"] + k]
            at = Z + a * row + 3 * (k + 1)
            q0 += d * work[at]
            q1 += d * work[at + 1]
            q2 += d * work[at + 2]
        store3(work, w + W_Q + 3 * a, (q0, q1, q2))
    for k in range(n):
        at = first + 3 * (k + 1)
        work[B + k], work[B + n + k], work[B + 2 * n + k] = pool[at], pool[at + 1], pool[at + 2]
        z = Z + 3 * (k + 1)
        work[B + 3 * n + k] = work[z + row + 2] - work[z + 2 * row + 1]
        work[B + 4 * n + k] = work[z + 2 * row] - work[z + 2]
        work[B + 5 * n + k] = work[z + 1] - work[z + row]
    write_rigid_inertia(w, pool[b["mass"]], work)


@njit(cache=True)
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


@njit(cache=True, fastmath=FAST)
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
    pn = b["pn"]
    if n > 0:
        rate = nq + b["ue"]
        ds = (0.0, 0.0, 0.0)
        S = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # S_ac = int r_a rdot_c
        for k in range(n):
            d = x[rate + k]
            ds = add(ds, scale(d, load3(pool, b["first"] + 3 * (k + 1))))
            z = Z + 3 * (k + 1)
            S = (
                S[0] + d * work[z], S[1] + d * work[z + 1], S[2] + d * work[z + 2],
                S[3] + d * work[z + row], S[4] + d * work[z + row + 1], S[5] + d * work[z + row + 2],
                S[6] + d * work[z + 2 * row], S[7] + d * work[z + 2 * row + 1], S[8] + d * work[z + 2 * row + 2],
            )  # fmt: skip
            work[pn + k] = 0.0
        force = add(force, scale(2.0, cross(o, ds)))
        trace = S[0] + S[4] + S[8]
        couple = add(couple, scale(2.0 * trace, o))
        couple = add(couple, scale(-2.0, (
            S[0] * o[0] + S[3] * o[1] + S[6] * o[2],
            S[1] * o[0] + S[4] * o[1] + S[7] * o[2],
            S[2] * o[0] + S[5] * o[1] + S[8] * o[2],
        )))  # fmt: skip
        for j in range(n):
            d = 2.0 * x[rate + j]
            g = b["gyro"] + 3 * n * j
            g0, g1, g2 = d * o[0], d * o[1], d * o[2]
            for k in range(n):
                work[pn + k] += g0 * pool[g + k] + g1 * pool[g + n + k] + g2 * pool[g + 2 * n + k]
        for k in range(n):
            z = Z + 3 * (k + 1)
            at = b["first"] + 3 * (k + 1)
            work[pn + k] += (
                W[0] * work[z] + W[1] * work[z + 1] + W[2] * work[z + 2]
                + W[3] * work[z + row] + W[4] * work[z + row + 1] + W[5] * work[z + row + 2]
                + W[6] * work[z + 2 * row] + W[7] * work[z + 2 * row + 1] + W[8] * work[z + 2 * row + 2]
                + uniform[0] * pool[at] + uniform[1] * pool[at + 1] + uniform[2] * pool[at + 2]
            )  # fmt: skip
    store3(work, w + W_P, force)
    store3(work, w + W_P + 3, couple)


@njit(cache=True, fastmath=FAST)
def add_elastic_forces(b: Record, x: Array, nq: int, pool: Array, work: Array) -> None:
    """Add f0 + V1 delta + D ddelta to the elastic bias pn (eq. 8)."""
    n, pn, q, u = b["n"], b["pn"], b["qe"], nq + b["ue"]
    K, D = b["stiffness"], b["damping"]
    if b["diagonal"]:
        for k in range(n):
            work[pn + k] += pool[b["f0"] + k] + pool[K + k * (n + 1)] * x[q + k] + pool[D + k * (n + 1)] * x[u + k]
        return
    for k in range(n):
        total = pool[b["f0"] + k]
        for j in range(n):
            total += pool[K + k * n + j] * x[q + j] + pool[D + k * n + j] * x[u + j]
        work[pn + k] += total


@njit(cache=True)
def zero_forces(b: Record, work: Array) -> None:
    """Clear the bias wrench and the elastic bias."""
    for j in range(6):
        work[b["work"] + W_P + j] = 0.0
    for k in range(b["n"]):
        work[b["pn"] + k] = 0.0


@njit(cache=True)
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
