"""Articulated inertia and bias of a body at its parent's origin, after its own freedoms are eliminated."""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.bodies.columns import six_lanes, wrench_times_columns
from femflex.dynamics.lowering.layout import W_CIP, W_M, W_R
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import lane, put_lane
from femflex.kernels.pairs import add_pair, wrench_at_origin
from femflex.kernels.spatial import Rows, add_rows, shifted_rows, turned_rows, weighted
from femflex.kernels.vectors import Vector, load3


@inner
def add_to_parent_rows(b: Record, parent: Record, work: Array) -> None:
    """Add [A | p] to the parent's rows and, through the node that carries the joint, to its elastic rows."""
    w = b["work"]
    rows = turned_rows(work, w + W_M, work, w + W_CIP)
    r = load3(work, w + W_R)
    if b["bends"]:
        add_to_parent_shapes(b, parent, work, rows, r)
    add_rows(work, parent["work"] + W_M, shifted_rows(rows, r))


@inner
def add_to_parent_shapes(b: Record, parent: Record, work: Array, rows: Rows, r: Vector) -> None:
    """Add the effect of the child's rows (parent axes, at the child's origin) on the parent's shapes: columns Phi.

    With F_k = A Phi_k: E_kj + F_k . Phi_j, and the coupling gains F_k at the parent's origin and pn_k + p . Phi_k.
    """
    row, stride, Phi = parent["row"], parent["stride"], b["Phi"]
    for i in range(parent["n"]):
        F = weighted(rows, work, Phi + i, row)
        entry = parent["border"] + stride * i
        add_pair(work, entry + row, wrench_at_origin(F, r))
        for k in range(i // 4 * 4, row, 4):
            put_lane(work, entry + k, lane(work, entry + k) + wrench_times_columns(F, six_lanes(work, Phi + k, row)))
