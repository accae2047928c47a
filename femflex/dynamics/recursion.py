"""The O(n) recursion: from the tips to the root every body is reduced to the inertia its parent feels, then back.

Per body, in the unknowns (a, alpha, ddot delta): A, B, E are the inertia, p and pn the bias. The elastic block is
eliminated first (unit matrix for mass-orthonormal shapes of a body whose moving nodes carry no child), then the joint.
The same pass solves the equations of motion, and (c_m M + c_d D + c_k K) x = rhs for implicit integrators, where the
modal stiffness only changes the elastic block.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from femflex.dynamics.layout import (
    W_A,
    W_ACC,
    W_BIAS,
    W_CIP,
    W_D,
    W_H,
    W_P,
    W_R,
    W_TAU,
    W_U,
    bodies_of,
)
from femflex.dynamics.small import cholesky, solve_cholesky
from femflex.dynamics.vectors import (
    FAST,
    Matrix,
    Vector,
    accumulate3,
    add,
    cross,
    load3,
    load9,
    product,
    store3,
    transpose,
    turn,
    turn_back,
)

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void


@njit(cache=True)
def start_elastic(b: Record, pool: Array, work: Array, c_d: float, c_k: float) -> None:
    """Write the elastic block E = Me + c_d D + c_k V1 where it will be factorised."""
    if b["dense"] or c_d != 0.0 or c_k != 0.0:
        for j in range(b["n"] * b["n"]):
            work[b["E"] + j] = (
                pool[b["elastic_mass"] + j] + c_d * pool[b["damping"] + j] + c_k * pool[b["stiffness"] + j]
            )


@njit(cache=True, fastmath=FAST)
def refer_to_hinge(b: Record, work: Array) -> None:
    """Change unknowns from the body's own acceleration to that of marker Q's carrier: B, E, pn with the columns G."""
    w, n = b["work"], b["n"]
    A, B, E, G, p, pn = w + W_A, b["B"], b["E"], b["G"], w + W_P, b["pn"]
    for k in range(n):
        for j in range(k + 1):  # E - G^T B - B^T G + G^T A G
            total = 0.0
            for r in range(6):
                total -= work[G + r * n + k] * work[B + r * n + j] + work[B + r * n + k] * work[G + r * n + j]
                AG = 0.0
                for c in range(6):
                    AG += work[A + 6 * r + c] * work[G + c * n + j]
                total += work[G + r * n + k] * AG
            work[E + k * n + j] += total
            if j != k:
                work[E + j * n + k] += total
    for k in range(n):
        for r in range(6):
            work[pn + k] -= work[G + r * n + k] * work[p + r]
        for r in range(6):
            AG = 0.0
            for c in range(6):
                AG += work[A + 6 * r + c] * work[G + c * n + k]
            work[B + r * n + k] -= AG


@njit(cache=True, fastmath=FAST)
def eliminate_elastic(b: Record, pool: Array, work: Array, stiff: bool) -> None:
    """A -= B E^-1 B^T and p -= B E^-1 pn, leaving Y = B E^-1 (6, n) and E^-1 pn in place of pn."""
    w, n = b["work"], b["n"]
    B, Y, pn = b["B"], b["Y"], b["pn"]
    for j in range(6 * n):
        work[Y + j] = work[B + j]
    if b["dense"] or stiff:
        cholesky(work, b["E"], n)
        for r in range(6):
            solve_cholesky(work, b["E"], n, work, Y + r * n)
        solve_cholesky(work, b["E"], n, work, pn)
    elif not b["orthonormal"]:
        for r in range(6):
            solve_cholesky(pool, b["elastic_cholesky"], n, work, Y + r * n)
        solve_cholesky(pool, b["elastic_cholesky"], n, work, pn)
    for r in range(6):
        for c in range(r + 1):
            total = 0.0
            for k in range(n):
                total += work[Y + r * n + k] * work[B + c * n + k]
            work[w + W_A + 6 * r + c] -= total
            if r != c:
                work[w + W_A + 6 * c + r] -= total
        total = 0.0
        for k in range(n):
            total += work[B + r * n + k] * work[pn + k]
        work[w + W_P + r] -= total


@njit(cache=True, fastmath=FAST)
def eliminate_joint(b: Record, pool: Array, work: Array, c_d: float, c_k: float) -> None:
    """Leave the articulated inertia and bias of the body, with its joint free, in A and p (bias acceleration included).

    U = A H, D = H^T U + c_d damper + c_k spring; p becomes the wrench at udot of the joint eliminated and the parent at
    rest; tau is replaced by D^-1 (tau - H^T (A bias + p)).
    """
    w, n_h = b["work"], b["n_h"]
    A, H, U, D, tau, p = w + W_A, w + W_H, w + W_U, w + W_D, w + W_TAU, w + W_P
    for r in range(6):
        total = 0.0
        for c in range(6):
            total += work[A + 6 * r + c] * work[w + W_BIAS + c]
        work[p + r] += total
    if n_h == 0:
        return
    for k in range(n_h):
        for r in range(6):
            total = 0.0
            for c in range(6):
                total += work[A + 6 * r + c] * work[H + 6 * k + c]
            work[U + 6 * k + r] = total
    first = 3 if b["hidden"] else 0
    for k in range(n_h):
        for j in range(n_h):
            total = 0.0
            for r in range(6):
                total += work[H + 6 * k + r] * work[U + 6 * j + r]
            work[D + n_h * k + j] = total
        if b["sprung"] and k >= first:
            work[D + n_h * k + k] += c_d * pool[b["damper"] + k - first] + c_k * pool[b["spring"] + k - first]
        total = work[tau + k - first] if k >= first else 0.0
        for r in range(6):
            total -= work[H + 6 * k + r] * work[p + r]
        work[w + W_ACC + k] = total
    for k in range(n_h):
        work[tau + k] = work[w + W_ACC + k]
    cholesky(work, D, n_h)
    solve_cholesky(work, D, n_h, work, tau)
    for r in range(6):
        row = w + W_ACC  # scratch: D^-1 U^T column r
        for k in range(n_h):
            work[row + k] = work[U + 6 * k + r]
            work[p + r] += work[U + 6 * k + r] * work[tau + k]
        solve_cholesky(work, D, n_h, work, row)
        for c in range(6):
            total = 0.0
            for k in range(n_h):
                total += work[row + k] * work[U + 6 * k + c]
            work[A + 6 * r + c] -= total


@njit(cache=True)
def block(work: Array, A: int, r: int, c: int) -> Matrix:
    """The 3 x 3 block (r, c) of the 6 x 6 matrix at A."""
    i = A + 18 * r + 3 * c
    return (
        work[i], work[i + 1], work[i + 2],
        work[i + 6], work[i + 7], work[i + 8],
        work[i + 12], work[i + 13], work[i + 14],
    )  # fmt: skip


@njit(cache=True)
def add_block(work: Array, A: int, r: int, c: int, m: Matrix) -> None:
    """Add to the 3 x 3 block (r, c) of the 6 x 6 matrix at A."""
    i = A + 18 * r + 3 * c
    accumulate3(work, i, (m[0], m[1], m[2]))
    accumulate3(work, i + 6, (m[3], m[4], m[5]))
    accumulate3(work, i + 12, (m[6], m[7], m[8]))


@njit(cache=True)
def add9(a: Matrix, b: Matrix) -> Matrix:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5], a[6] + b[6], a[7] + b[7], a[8] + b[8]


@njit(cache=True)
def cross_matrix(v: Vector, m: Matrix) -> Matrix:
    """skew(v) m."""
    a = cross(v, (m[0], m[3], m[6]))
    b = cross(v, (m[1], m[4], m[7]))
    c = cross(v, (m[2], m[5], m[8]))
    return a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2]


@njit(cache=True, fastmath=FAST)
def hand_to_parent(b: Record, parent: Record, work: Array) -> None:
    """Add the articulated inertia and bias to the parent's A, p and, through its moving node, to its B, E, pn."""
    w, wp = b["work"], parent["work"]
    C = load9(work, w + W_CIP)
    back = transpose(C)
    A, Ap = w + W_A, wp + W_A
    aa = product(back, product(block(work, A, 0, 0), C))
    ab = product(back, product(block(work, A, 0, 1), C))
    bb = product(back, product(block(work, A, 1, 1), C))
    f = turn_back(C, load3(work, w + W_P))
    m = turn_back(C, load3(work, w + W_P + 3))
    if b["bends"]:
        hand_to_shapes(b, parent, work, aa, ab, bb, f, m)
    r = load3(work, w + W_R)
    # shift to the parent's origin: a_i = a_p - r x alpha_p
    ra = cross_matrix(r, aa)
    ab_p = add9(transpose(ra), ab)  # aa (-skew r) + ab
    rab = cross_matrix(r, ab_p)
    bb_p = add9(bb, add9(rab, transpose(cross_matrix(r, ab))))
    add_block(work, Ap, 0, 0, aa)
    add_block(work, Ap, 0, 1, ab_p)
    add_block(work, Ap, 1, 0, transpose(ab_p))
    add_block(work, Ap, 1, 1, bb_p)
    accumulate3(work, wp + W_P, f)
    accumulate3(work, wp + W_P + 3, add(m, cross(r, f)))


@njit(cache=True, fastmath=FAST)
def hand_to_shapes(
    b: Record, parent: Record, work: Array, aa: Matrix, ab: Matrix, bb: Matrix, f: Vector, m: Vector
) -> None:
    """Add what the child's inertia (parent axes, at the child's origin) means for the parent's shapes: columns Phi."""
    n, Phi, B, E, pn = parent["n"], b["Phi"], parent["B"], parent["E"], parent["pn"]
    r = load3(work, b["work"] + W_R)
    ba = transpose(ab)
    for k in range(n):
        v = (work[Phi + k], work[Phi + n + k], work[Phi + 2 * n + k])
        s = (work[Phi + 3 * n + k], work[Phi + 4 * n + k], work[Phi + 5 * n + k])
        force = add(turn(aa, v), turn(ab, s))
        couple = add(turn(ba, v), turn(bb, s))
        about = add(couple, cross(r, force))
        for i in range(3):
            work[B + i * n + k] += force[i]
            work[B + (3 + i) * n + k] += about[i]
        for j in range(n):
            work[E + k * n + j] += (
                force[0] * work[Phi + j] + force[1] * work[Phi + n + j] + force[2] * work[Phi + 2 * n + j]
                + couple[0] * work[Phi + 3 * n + j] + couple[1] * work[Phi + 4 * n + j] + couple[2] * work[Phi + 5 * n + j]
            )  # fmt: skip
        work[pn + k] += f[0] * v[0] + f[1] * v[1] + f[2] * v[2] + m[0] * s[0] + m[1] * s[1] + m[2] * s[2]


@njit(cache=True)
def reduce_to_root(table: Table, pool: Array, work: Array, c_d: float, c_k: float) -> None:
    """Tips to root: eliminate every body's elastic block and joint."""
    bodies = bodies_of(table)
    stiff = c_d != 0.0 or c_k != 0.0
    for i in range(1, len(bodies)):
        start_elastic(bodies[i], pool, work, c_d, c_k)
    for j in range(1, len(bodies)):
        i = len(bodies) - j
        b = bodies[i]
        if b["own_bends"]:
            refer_to_hinge(b, work)
        if b["n"] > 0:
            eliminate_elastic(b, pool, work, stiff)
        eliminate_joint(b, pool, work, c_d, c_k)
        if b["parent"] > 0:
            hand_to_parent(b, bodies[b["parent"]], work)


@njit(cache=True, fastmath=FAST)
def accelerate(table: Table, work: Array, out: Array, start: int) -> None:
    """Root to tips: write udot to out[start:], and each body's acceleration (6) to its block."""
    bodies = bodies_of(table)
    for i in range(1, len(bodies)):
        b = bodies[i]
        parent = bodies[b["parent"]]
        w, wp, n, n_h = b["work"], parent["work"], b["n"], b["n_h"]
        C = load9(work, w + W_CIP)
        alpha_p = load3(work, wp + W_ACC + 3)
        a = add(load3(work, wp + W_ACC), cross(alpha_p, load3(work, w + W_R)))
        if b["bends"]:
            n_p, Phi, rate = parent["n"], b["Phi"], start + parent["ue"]
            for k in range(n_p):
                d = out[rate + k]
                a = add(a, (d * work[Phi + k], d * work[Phi + n_p + k], d * work[Phi + 2 * n_p + k]))
                alpha_p = add(alpha_p, (d * work[Phi + 3 * n_p + k], d * work[Phi + 4 * n_p + k], d * work[Phi + 5 * n_p + k]))
        acc = w + W_ACC
        store3(work, acc, turn(C, a))
        store3(work, acc + 3, turn(C, alpha_p))
        # joint: udot = D^-1 (tau - H^T p - U^T a), the first part already in tau
        if n_h > 0:
            tau = w + W_TAU
            rhs = w + W_P  # the wrench has been handed on; its place is free
            for k in range(n_h):
                total = 0.0
                for r in range(6):
                    total += work[w + W_U + 6 * k + r] * work[acc + r]
                work[rhs + k] = total
            solve_cholesky(work, w + W_D, n_h, work, rhs)
            hidden = 3 if b["hidden"] else 0
            for k in range(n_h):
                rate_k = work[tau + k] - work[rhs + k]
                for r in range(6):
                    work[acc + r] += work[w + W_H + 6 * k + r] * rate_k
                if k >= hidden:
                    out[start + b["u"] + k - hidden] = rate_k
        for r in range(6):
            work[acc + r] += work[w + W_BIAS + r]
        if n > 0:
            for k in range(n):
                total = work[b["pn"] + k]
                for r in range(6):
                    total += work[b["Y"] + r * n + k] * work[acc + r]
                out[start + b["ue"] + k] = -total
            if b["own_bends"]:
                for r in range(6):
                    for k in range(n):
                        work[acc + r] -= work[b["G"] + r * n + k] * out[start + b["ue"] + k]
