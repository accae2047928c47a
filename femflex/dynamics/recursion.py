"""The O(n) recursion: from the tips to the root every body is reduced to the inertia its parent feels, then back.

Per body, in the unknowns (a, alpha, ddot delta): [A | p] are the rows of the rigid motion (see spatial), E, B, pn
those of the shapes. The same pass solves the equations of motion, and (c_m M + c_d D + c_k K) x = rhs for implicit
integrators, where the modal stiffness only changes the elastic block.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.elimination import (
    eliminate_elastic,
    eliminate_joint,
    refer_to_hinge,
    write_elastic_block,
    write_rows,
)
from femflex.dynamics.formula import formula
from femflex.dynamics.handover import hand_to_parent, six_lanes
from femflex.dynamics.lanes import Lane, entry, lane, nothing, put, totals
from femflex.dynamics.layout import W_ACC, W_BIAS, W_CIP, W_H, W_M, W_PIVOT, W_R, W_U, body_of, header_of
from femflex.dynamics.shapes import Lanes, plus
from femflex.dynamics.spatial import Pair, dot_pair, free_motion, pair, put_pair
from femflex.dynamics.vectors import ZERO, add, cross, dot, inner, load3, load_rows, scale, store_lane, sub, turn

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void


@inner
def reduce_to_root(table: Table, pool: Array, work: Array, c_d: float, c_k: float, forced: bool) -> None:
    """Tips to root: eliminate every body's elastic block and joint; forced: there are forces on free root joints."""
    n_bodies = header_of(table)["n_bodies"]
    for i in range(1, n_bodies):
        write_rows(body_of(table, i), pool, work)
        write_elastic_block(body_of(table, i), pool, work, c_d, c_k)
    for i in range(n_bodies - 1, 0, -1):
        b = body_of(table, i)
        if b["own_bends"]:
            refer_to_hinge(b, work)
        if b["n"] > 0:
            eliminate_elastic(b, work, c_d != 0.0 or c_k != 0.0)
        if forced or not b["full"]:
            eliminate_joint(b, pool, work, c_d, c_k, forced)
        if b["parent"] > 0:
            hand_to_parent(b, body_of(table, b["parent"]), work)


@inner
def accelerate(table: Table, work: Array, out: Array, forced: bool) -> None:
    """Root to tips: write udot to out, and each body's acceleration to its block."""
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        if b["full"] and not forced:
            release_root(b, work, out)
        else:
            carry_acceleration(b, body_of(table, b["parent"]), work)
            accelerate_joint(b, work, out)
        if b["n"] > 0:
            accelerate_shapes(b, work, out)


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
def carry_acceleration(b: Record, parent: Record, work: Array) -> None:
    """Write the acceleration that the parent gives the body with its joint at rest.

    What the base frame gives is known beforehand and stands in the bias.
    """
    w, wp = b["work"], parent["work"]
    a, alpha = ZERO, ZERO
    if b["parent"] > 0:
        a, alpha = load3(work, wp + W_ACC), load3(work, wp + W_ACC + 4)
        a = add(a, cross(alpha, load3(work, w + W_R)))
        if b["bends"]:
            lift = columns_times(work, b["Phi"], parent["row"], parent["accel"])
            a, alpha = add(a, first3(lift[0])), add(alpha, first3(lift[1]))
        C = load_rows(work, w + W_CIP)
        a, alpha = turn(C, a), turn(C, alpha)
    store_lane(work, w + W_ACC, a)
    store_lane(work, w + W_ACC + 4, alpha, 1.0)


@inner
def accelerate_joint(b: Record, work: Array, out: Array) -> None:
    """Write udot = -(U . a + h . p - tau)/d of each joint freedom, the last eliminated first; add what they give."""
    w = b["work"]
    acc = pair(work, w + W_ACC)
    hidden = 3 if b["hidden"] else 0
    for k in range(b["n_h"] - 1, -1, -1):
        udot = -work[w + W_PIVOT + k] * dot_pair(acc, pair(work, w + W_U + 8 * k))
        acc = gained(acc, udot, pair(work, w + W_H + 8 * k))
        if k >= hidden:
            out[b["u"] + k - hidden] = udot
    put_pair(work, w + W_ACC, gained(acc, 1.0, pair(work, w + W_BIAS)))


@inner
def accelerate_shapes(b: Record, work: Array, out: Array) -> None:
    """Write the elastic accelerations -(Y a + E^-1 pn); the body's own acceleration follows its marker Q."""
    w, row, stride, accel = b["work"], b["row"], b["stride"], b["accel"]
    acc = pair(work, w + W_ACC)
    for k in range(0, row, 4):
        put(work, accel + k, -1.0 * along_four(work, b["border"] + stride * k + row, stride, acc))
    for k in range(b["n"]):
        out[b["ue"] + k] = work[accel + k]
    if b["own_bends"]:
        put_pair(work, w + W_ACC, gained(acc, -1.0, columns_times(work, b["G"], row, accel)))


@formula
def gained(a: Pair, s: float, b: Pair) -> Pair:
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1]


@formula
def along_four(a: Array, i: int, stride: int, v: Pair) -> Lane:
    """v . row of four rows of eight, `stride` apart."""
    products = [lane(a, i + j * stride) * v[0] + lane(a, i + j * stride + 4) * v[1] for j in range(4)]
    return totals(products[0], products[1], products[2], products[3])


@inner
def columns_times(work: Array, columns: int, row: int, rates: int) -> Pair:
    """Six rows times the row of rates: acceleration (3), 0, (3), 0."""
    v = six_nothings()
    for k in range(0, row, 4):
        v = plus(v, lane(work, rates + k), six_lanes(work, columns + k, row))
    return six_totals(v)


@formula
def six_nothings() -> Lanes:
    """Six lanes of zeros."""
    return tuple(nothing() for _ in range(6))


@formula
def six_totals(v: Lanes) -> Pair:
    """Sums over the four shapes of each of six components, (3), 0, (3), 0."""
    return totals(v[0], v[1], v[2], nothing()), totals(v[3], v[4], v[5], nothing())


@formula
def first3(v: Lane) -> tuple[float, float, float]:
    """The three-vector in a lane."""
    return tuple(entry(v, i) for i in range(3))  # type: ignore[return-value]
