"""The joint's freedoms: eliminated from [A | p] on the way to the root, solved on the way back."""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.lowering.layout import W_ACC, W_BIAS, W_H, W_M, W_PIVOT, W_RESIST, W_TAU, W_U
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import fourth, plus, reciprocal, with_fourth
from femflex.kernels.pairs import dot_pair, pair, put_pair
from femflex.kernels.spatial import free_motion, less_outer, put_six_rows, rows_times, six_rows, with_bias
from femflex.kernels.vectors import dot, load3, scale, store_lane, sub


@inner
def eliminate_joint(b: Record, pool: Array, work: Array, c_d: float, c_k: float, forced: bool) -> None:
    """Take the joint's freedoms out of [A | p], one after the other, the bias acceleration included in p.

    Freedom k with column h: U = A h, d = h . U + c_d damper + c_k spring + that of laws, and the force that remains
    is h . p - tau, kept in the last place of U. Prescribed freedoms (pivot 0, see prescribed_motion) stay in [A | p].
    """
    w = b["work"]
    rows = with_bias(six_rows(work, w + W_M), pair(work, w + W_BIAS))
    hidden = 3 if b["hidden"] else 0
    for k in range(b["n_h"]):
        if b["held"] and work[w + W_PIVOT + k] == 0.0:
            continue
        h = pair(work, w + W_H + 8 * k)
        U = rows_times(rows, h)
        d, force = dot_pair(U, h), fourth(U[1])
        if k >= hidden:
            if b["sprung"] or forced:
                force -= work[w + W_TAU + k - hidden]
            if b["sprung"]:
                d += c_d * pool[b["damper"] + k - hidden] + c_k * pool[b["spring"] + k - hidden]
                if b["lawful"] and (c_d != 0.0 or c_k != 0.0):
                    d += work[w + W_RESIST + k - hidden]
        d = reciprocal(d)
        U = (U[0], with_fourth(U[1], force))
        put_pair(work, w + W_U + 8 * k, U)
        work[w + W_PIVOT + k] = d
        rows = less_outer(rows, U, (d * U[0], d * U[1]))
    put_six_rows(work, w + W_M, rows)


@inner
def accelerate_joint(b: Record, work: Array, out: Array) -> None:
    """Write udot = -(U . a + h . p - tau)/d of each joint freedom, the last eliminated first, and add their effect."""
    w = b["work"]
    acc = pair(work, w + W_ACC)
    hidden = 3 if b["hidden"] else 0
    for k in range(b["n_h"] - 1, -1, -1):
        udot = -work[w + W_PIVOT + k] * dot_pair(acc, pair(work, w + W_U + 8 * k))
        acc = plus(acc, udot, pair(work, w + W_H + 8 * k))
        if k >= hidden:
            out[b["u"] + k - hidden] = udot
    put_pair(work, w + W_ACC, plus(acc, 1.0, pair(work, w + W_BIAS)))


@inner
def release_root(b: Record, work: Array, out: Array) -> None:
    """Acceleration -A^-1 p of a root body free in all six motions and free of joint forces.

    The columns of H are orthonormal in pairs: slides (e, 0), turns (r_Q x h, h).
    """
    w, u = b["work"], b["u"] - (3 if b["hidden"] else 0)
    x = free_motion(work, w + W_M)
    a, alpha = (-x[0], -x[1], -x[2]), (-x[3], -x[4], -x[5])
    store_lane(work, w + W_ACC, a)
    store_lane(work, w + W_ACC + 4, alpha, 1.0)
    a, alpha = sub(a, load3(work, w + W_BIAS)), sub(alpha, load3(work, w + W_BIAS + 4))
    for k in range(3, 6):
        rate = dot(load3(work, w + W_H + 8 * k + 4), alpha)
        a = sub(a, scale(rate, load3(work, w + W_H + 8 * k)))
        out[u + k] = rate
    if not b["hidden"]:
        for k in range(3):
            out[u + k] = dot(load3(work, w + W_H + 8 * k), a)
