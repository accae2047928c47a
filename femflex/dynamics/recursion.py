"""The O(n) recursion: from the tips to the root every body is reduced to the inertia its parent feels, then back.

Per body, in the unknowns (a, alpha, ddot delta): A, B, E are the inertia, p and pn the bias. The elastic block is
eliminated first (unit matrix for mass-orthonormal shapes of a body whose moving nodes carry no child), then the joint.
The same pass solves the equations of motion, and (c_m M + c_d D + c_k K) x = rhs for implicit integrators, where the
modal stiffness only changes the elastic block.
"""

from __future__ import annotations

import numpy as np
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
from femflex.dynamics.small import factorise, solve_factorised
from femflex.dynamics.vectors import (
    Matrix,
    Vector,
    accumulate3,
    add,
    add9,
    cross,
    cross_matrix,
    dot,
    inner,
    load3,
    load9,
    product,
    scale,
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
def start_elastic(b: Record, pool: Array, work: Array, c_d: float, c_k: float) -> None:
    """Write the elastic block E = Me + c_d D + c_k V1 where it will be factorised."""
    if b["dense"] or c_d != 0.0 or c_k != 0.0:
        for j in range(b["n"] * b["n"]):
            work[b["E"] + j] = (
                pool[b["elastic_mass"] + j] + c_d * pool[b["damping"] + j] + c_k * pool[b["stiffness"] + j]
            )


@inner
def refer_to_hinge(b: Record, work: Array) -> None:
    """Change unknowns from the body's own acceleration to that of marker Q's carrier: B, E, pn with the columns G."""
    w, n = b["work"], b["n"]
    A, p = work[w + W_A : w + W_A + 36], work[w + W_P : w + W_P + 6]
    B, G, AG = work[b["B"] : b["B"] + 6 * n], work[b["G"] : b["G"] + 6 * n], work[b["Y"] : b["Y"] + 6 * n]
    E, pn = work[b["E"] : b["E"] + n * n], work[b["pn"] : b["pn"] + n]
    for r in range(6):
        for k in range(n):
            AG[r * n + k] = 0.0
        for c in range(6):
            a = A[6 * r + c]
            for k in range(n):
                AG[r * n + k] += a * G[c * n + k]
    for r in range(6):  # E - G^T B - B^T G + G^T A G
        for k in range(n):
            g, h = G[r * n + k], B[r * n + k]
            for j in range(n):
                E[k * n + j] += g * (AG[r * n + j] - B[r * n + j]) - h * G[r * n + j]
    for r in range(6):
        for k in range(n):
            pn[k] -= G[r * n + k] * p[r]
            B[r * n + k] -= AG[r * n + k]


@inner
def eliminate_elastic(b: Record, pool: Array, work: Array, stiff: bool) -> None:
    """A -= B E^-1 B^T and p -= B E^-1 pn, leaving Y = B E^-1 (6, n) and E^-1 pn in place of pn."""
    w, n = b["work"], b["n"]
    A, p = work[w + W_A : w + W_A + 36], work[w + W_P : w + W_P + 6]
    B, Y, pn = work[b["B"] : b["B"] + 6 * n], work[b["Y"] : b["Y"] + 6 * n], work[b["pn"] : b["pn"] + n]
    for j in range(6 * n):
        Y[j] = B[j]
    if b["dense"] or stiff:
        E = work[b["E"] : b["E"] + n * n]
        factorise(E, n)
        for r in range(6):
            solve_factorised(E, n, Y[r * n : (r + 1) * n])
        solve_factorised(E, n, pn)
    elif not b["orthonormal"]:
        L = pool[b["elastic_factor"] : b["elastic_factor"] + n * n]
        for r in range(6):
            solve_factorised(L, n, Y[r * n : (r + 1) * n])
        solve_factorised(L, n, pn)
    for r in range(6):
        B_r = B[r * n : (r + 1) * n]
        for c in range(r + 1):
            Y_c = Y[c * n : (c + 1) * n]
            total = 0.0
            for k in range(n):
                total += B_r[k] * Y_c[k]
            A[6 * r + c] -= total
            if r != c:
                A[6 * c + r] -= total
        total = 0.0
        for k in range(n):
            total += B_r[k] * pn[k]
        p[r] -= total


@inner
def eliminate_joint(b: Record, pool: Array, work: Array, c_d: float, c_k: float) -> None:
    """Leave the articulated inertia and bias of the body, with its joint free, in A and p (bias acceleration included).

    U = A H, D = H^T U + c_d damper + c_k spring; tau is replaced by D^-1 (tau - H^T p); p becomes the wrench with the
    joint eliminated and the parent at rest. A body on the base frame has no parent to hand A and p to.
    """
    w, n_h = b["work"], b["n_h"]
    A, p = work[w + W_A : w + W_A + 36], work[w + W_P : w + W_P + 6]
    bias = work[w + W_BIAS : w + W_BIAS + 6]
    for r in range(6):
        total = 0.0
        for c in range(6):
            total += A[6 * r + c] * bias[c]
        p[r] += total
    if n_h == 0:
        return
    H, U = work[w + W_H : w + W_H + 36], work[w + W_U : w + W_U + 36]
    D, tau, row = work[w + W_D : w + W_D + 36], work[w + W_TAU : w + W_TAU + 6], work[w + W_ACC : w + W_ACC + 6]
    for k in range(n_h):
        for r in range(6):
            total = 0.0
            for c in range(6):
                total += A[6 * r + c] * H[6 * k + c]
            U[6 * k + r] = total
    first = 3 if b["hidden"] else 0
    for k in range(n_h):
        for j in range(k + 1):
            total = 0.0
            for r in range(6):
                total += H[6 * k + r] * U[6 * j + r]
            D[n_h * k + j] = total
        if b["sprung"] and k >= first:
            D[n_h * k + k] += c_d * pool[b["damper"] + k - first] + c_k * pool[b["spring"] + k - first]
        total = tau[k - first] if k >= first else 0.0
        for r in range(6):
            total -= H[6 * k + r] * p[r]
        row[k] = total
    for k in range(n_h):
        tau[k] = row[k]
    factorise(D, n_h)
    solve_factorised(D, n_h, tau)
    if b["parent"] == 0:
        return
    for r in range(6):
        for k in range(n_h):
            row[k] = U[6 * k + r]
            p[r] += U[6 * k + r] * tau[k]
        solve_factorised(D, n_h, row)
        for c in range(6):
            total = 0.0
            for k in range(n_h):
                total += row[k] * U[6 * k + c]
            A[6 * r + c] -= total


@inner
def release_root(b: Record, work: Array) -> None:
    """eliminate_joint for a root body free in all six motions and free of joint forces: its acceleration is -A^-1 p.

    Leaves udot of the joint in tau; the columns of H are orthonormal in pairs: slides (e, 0), turns (r_Q x h, h).
    """
    w = b["work"]
    A, p, H = work[w + W_A : w + W_A + 36], work[w + W_P : w + W_P + 6], work[w + W_H : w + W_H + 36]
    tau = work[w + W_TAU : w + W_TAU + 6]
    factorise(A, 6)
    solve_factorised(A, 6, p)
    a = sub(scale(-1.0, load3(p, 0)), load3(work, w + W_BIAS))
    alpha = sub(scale(-1.0, load3(p, 3)), load3(work, w + W_BIAS + 3))
    for k in range(3):
        turning = load3(H, 18 + 6 * k + 3)
        tau[3 + k] = dot(turning, alpha)
        a = sub(a, scale(tau[3 + k], load3(H, 18 + 6 * k)))
    for k in range(3):
        tau[k] = dot(load3(H, 6 * k), a)


@inner
def block(work: Array, A: int, r: int, c: int) -> Matrix:
    """The 3 x 3 block (r, c) of the 6 x 6 matrix at A."""
    i = A + 18 * r + 3 * c
    return (
        work[i], work[i + 1], work[i + 2],
        work[i + 6], work[i + 7], work[i + 8],
        work[i + 12], work[i + 13], work[i + 14],
    )  # fmt: skip


@inner
def add_block(work: Array, A: int, r: int, c: int, m: Matrix) -> None:
    """Add to the 3 x 3 block (r, c) of the 6 x 6 matrix at A."""
    i = A + 18 * r + 3 * c
    accumulate3(work, i, (m[0], m[1], m[2]))
    accumulate3(work, i + 6, (m[3], m[4], m[5]))
    accumulate3(work, i + 12, (m[6], m[7], m[8]))


@inner
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


@inner
def hand_to_shapes(
    b: Record, parent: Record, work: Array, aa: Matrix, ab: Matrix, bb: Matrix, f: Vector, m: Vector
) -> None:
    """Add what the child's inertia (parent axes, at the child's origin) means for the parent's shapes: columns Phi."""
    n = parent["n"]
    Phi = work[b["Phi"] : b["Phi"] + 6 * n]
    B, E = work[parent["B"] : parent["B"] + 6 * n], work[parent["E"] : parent["E"] + n * n]
    pn = work[parent["pn"] : parent["pn"] + n]
    r = load3(work, b["work"] + W_R)
    ba = transpose(ab)
    vx, vy, vz = Phi[:n], Phi[n : 2 * n], Phi[2 * n : 3 * n]
    sx, sy, sz = Phi[3 * n : 4 * n], Phi[4 * n : 5 * n], Phi[5 * n :]
    for k in range(n):
        v, s = (vx[k], vy[k], vz[k]), (sx[k], sy[k], sz[k])
        force = add(turn(aa, v), turn(ab, s))
        couple = add(turn(ba, v), turn(bb, s))
        about = add(couple, cross(r, force))
        for i in range(3):
            B[i * n + k] += force[i]
            B[(3 + i) * n + k] += about[i]
        row = E[k * n : (k + 1) * n]
        for j in range(n):
            row[j] += force[0] * vx[j] + force[1] * vy[j] + force[2] * vz[j]
            row[j] += couple[0] * sx[j] + couple[1] * sy[j] + couple[2] * sz[j]
        pn[k] += f[0] * v[0] + f[1] * v[1] + f[2] * v[2] + m[0] * s[0] + m[1] * s[1] + m[2] * s[2]


@inner
def reduce_to_root(table: Table, pool: Array, work: Array, c_d: float, c_k: float, forced: bool) -> None:
    """Tips to root: eliminate every body's elastic block and joint; forced: there are forces on free root joints."""
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
        if b["full"] and not forced:
            release_root(b, work)
        else:
            eliminate_joint(b, pool, work, c_d, c_k)
        if b["parent"] > 0:
            hand_to_parent(b, bodies[b["parent"]], work)


@inner
def columns_times(columns: Array, rates: Array) -> tuple[float, float, float, float, float, float]:
    """columns (6, n) laid flat, times rates (n,)."""
    n = rates.size
    a = b = c = d = e = f = 0.0
    for k in range(n):
        r = rates[k]
        a += columns[k] * r
        b += columns[n + k] * r
        c += columns[2 * n + k] * r
        d += columns[3 * n + k] * r
        e += columns[4 * n + k] * r
        f += columns[5 * n + k] * r
    return a, b, c, d, e, f


@inner
def carry_acceleration(b: Record, parent: Record, work: Array, out: Array, start: int) -> None:
    """Write the acceleration that the parent gives the body with its joint at rest."""
    w, wp = b["work"], parent["work"]
    alpha_p = load3(work, wp + W_ACC + 3)
    a = add(load3(work, wp + W_ACC), cross(alpha_p, load3(work, w + W_R)))
    if b["bends"]:
        n_p = parent["n"]
        rates = out[start + parent["ue"] : start + parent["ue"] + n_p]
        lift = columns_times(work[b["Phi"] : b["Phi"] + 6 * n_p], rates)
        a = add(a, (lift[0], lift[1], lift[2]))
        alpha_p = add(alpha_p, (lift[3], lift[4], lift[5]))
    C = load9(work, w + W_CIP)
    store3(work, w + W_ACC, turn(C, a))
    store3(work, w + W_ACC + 3, turn(C, alpha_p))


@inner
def accelerate(table: Table, work: Array, out: Array, start: int) -> None:
    """Root to tips: write udot to out[start:], and each body's acceleration (6) to its block."""
    bodies = bodies_of(table)
    for i in range(1, len(bodies)):
        b = bodies[i]
        parent = bodies[b["parent"]]
        w, n, n_h = b["work"], b["n"], b["n_h"]
        acc = work[w + W_ACC : w + W_ACC + 6]
        if b["parent"] > 0:
            carry_acceleration(b, parent, work, out, start)
        else:  # the base frame's acceleration stands in the bias
            store3(acc, 0, (0.0, 0.0, 0.0))
            store3(acc, 3, (0.0, 0.0, 0.0))
        if n_h > 0:  # udot = D^-1 (tau - H^T p) - D^-1 U^T a, the first part already in tau
            tau, H = work[w + W_TAU : w + W_TAU + 6], work[w + W_H : w + W_H + 36]
            if b["parent"] > 0:
                U, rhs = work[w + W_U : w + W_U + 36], work[w + W_P : w + W_P + 6]  # p has been handed on
                for k in range(n_h):
                    total = 0.0
                    for r in range(6):
                        total += U[6 * k + r] * acc[r]
                    rhs[k] = total
                solve_factorised(work[w + W_D : w + W_D + 36], n_h, rhs)
                for k in range(n_h):
                    tau[k] -= rhs[k]
            hidden = 3 if b["hidden"] else 0
            for k in range(n_h):
                for r in range(6):
                    acc[r] += H[6 * k + r] * tau[k]
                if k >= hidden:
                    out[start + b["u"] + k - hidden] = tau[k]
        for r in range(6):
            acc[r] += work[w + W_BIAS + r]
        if n > 0:
            own = out[start + b["ue"] : start + b["ue"] + n]
            pn = work[b["pn"] : b["pn"] + n]
            for k in range(n):
                own[k] = -pn[k]
            for r in range(6):
                Y_r = work[b["Y"] + r * n : b["Y"] + (r + 1) * n]
                for k in range(n):
                    own[k] -= Y_r[k] * acc[r]
            if b["own_bends"]:
                drop = columns_times(work[b["G"] : b["G"] + 6 * n], own)
                for r in range(6):
                    acc[r] -= drop[r]
