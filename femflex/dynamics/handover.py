"""What a body hands to its parent once its own freedoms are eliminated: inertia and bias at the parent's origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.formula import formula
from femflex.dynamics.lanes import cross_lane, entry, lane, lane_of, put
from femflex.dynamics.layout import SLOTS, W_CIP, W_M, W_R
from femflex.dynamics.shapes import Lanes
from femflex.dynamics.spatial import Pair, Rows, add_rows, shifted_rows, turned_rows, weighted
from femflex.dynamics.vectors import Vector, inner, load3

Array = NDArray[np.float64]
Record = np.void


@inner
def hand_to_parent(b: Record, parent: Record, work: Array) -> None:
    """Add [A | p] to the parent's rows and, through the node that carries the joint, to its elastic rows."""
    w = b["work"]
    rows = turned_rows(work, w + W_M, work, w + W_CIP)
    r = load3(work, w + W_R)
    if b["bends"]:
        hand_to_shapes(b, parent, work, rows, r)
    add_rows(work, parent["work"] + W_M, shifted_rows(rows, r))


@inner
def hand_to_shapes(b: Record, parent: Record, work: Array, rows: Rows, r: Vector) -> None:
    """Add what the child's rows (parent axes, at the child's origin) mean for the parent's shapes: columns Phi.

    With F_k = A Phi_k: E_kj + F_k . Phi_j, and the coupling gains F_k at the parent's origin and pn_k + p . Phi_k.
    """
    row, stride, Phi = parent["row"], parent["stride"], b["Phi"]
    for i in range(parent["n"]):
        F = weighted(rows, work, Phi + i, row)
        at = parent["border"] + stride * i
        add_pair(work, at + row, at_origin(F, r))
        for k in range(i // 4 * 4, row, 4):
            put(work, at + k, lane(work, at + k) + along(F, six_lanes(work, Phi + k, row)))


@formula
def add_pair(a: Array, i: int, v: Pair) -> None:
    """Add two lanes to a[i : i + 8]."""
    put(a, i, lane(a, i) + v[0])
    put(a, i + 4, lane(a, i + 4) + v[1])


@formula
def at_origin(F: Pair, r: Vector) -> Pair:
    """Force and couple at the origin, of a force and couple at r."""
    return F[0], F[1] + cross_lane(lane_of(r[0], r[1], r[2], 0.0), F[0])


@formula
def six_lanes(a: Array, i: int, row: int) -> Lanes:
    """Lanes at the same place of six rows."""
    return tuple(lane(a, i + r * row) for r in range(6))


@formula
def along(F: Pair, columns: Lanes) -> Lanes:
    """F . Phi_j for four columns."""
    numbers = [entry(F[slot // 4], slot % 4) for slot in SLOTS]
    first = numbers[0] * columns[0]
    for r in range(1, 6):
        first = first + numbers[r] * columns[r]
    return first
