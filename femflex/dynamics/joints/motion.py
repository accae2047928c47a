"""Joints of the tree: springs and dampers, and their freedoms, eliminated to the root and solved on the way back."""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.layout.records import BALL_NONE, W_ACC, W_BIAS, W_CPQ, W_H, W_M, W_PIVOT, W_RESIST, W_TAU, W_U
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import fourth, plus, reciprocal, with_fourth
from femflex.kernels.pairs import dot_pair, pair, put_pair
from femflex.kernels.spatial import free_motion, less_outer, put_six_rows, rows_times, six_rows, with_bias
from femflex.kernels.turns import vector_of, vector_tangent
from femflex.kernels.vectors import dot, load3, load9, scale, solve3, store_lane, sub


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


@inner
def write_spring_forces(b: Record, q: Array, u: Array, pool: Array, work: Array) -> None:
    """Write the forces of joint springs and dampers on the joint's quasi-coordinates (n_u)."""
    tau = b["work"] + W_TAU
    free = b["n_slide"] + b["n_turn"]
    for k in range(free):
        stretch = q[b["q"] + k] - pool[b["rest"] + k]
        work[tau + k] = -pool[b["spring"] + k] * stretch - pool[b["damper"] + k] * u[b["u"] + k]
    if b["ball"] == BALL_NONE:
        return
    theta = vector_of(load9(work, b["work"] + W_CPQ))
    k, rest, c, v = b["spring"] + free, b["rest"] + free, b["damper"] + free, b["u"] + free
    pull = (
        -pool[k] * (theta[0] - pool[rest]),
        -pool[k + 1] * (theta[1] - pool[rest + 1]),
        -pool[k + 2] * (theta[2] - pool[rest + 2]),
    )
    torque = solve3(vector_tangent(theta), pull)  # V_theta dtheta/dt with dtheta/dt = T^-T omega
    for j in range(3):
        work[tau + free + j] = torque[j] - pool[c + j] * u[v + j]


@inner
def spring_energy(b: Record, q: Array, pool: Array, work: Array) -> float:
    """Energy stored in the joint's springs."""
    if not b["sprung"]:
        return 0.0
    free = b["n_slide"] + b["n_turn"]
    total = 0.0
    for k in range(free):
        total += 0.5 * pool[b["spring"] + k] * (q[b["q"] + k] - pool[b["rest"] + k]) ** 2
    if b["ball"] != BALL_NONE:
        theta = vector_of(load9(work, b["work"] + W_CPQ))
        for k in range(3):
            total += 0.5 * pool[b["spring"] + free + k] * (theta[k] - pool[b["rest"] + free + k]) ** 2
    return total
