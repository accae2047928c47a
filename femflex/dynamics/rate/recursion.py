"""The O(n) recursion: from the tips to the root every body is reduced to the inertia its parent feels, then back.

Per body, in the unknowns (a, alpha, ddot delta): [A | p] are the rows of the rigid, then articulated motion (see
spatial), E, B, pn those of the shapes. The same pass solves the equations of motion, and (c_m M + c_d D + c_k K) x =
rhs for implicit integrators, where the modal stiffness only changes the elastic block.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.elastic import (
    accelerate_shapes,
    eliminate_elastic,
    refer_to_hinge,
    write_elastic_block,
    write_rows,
)
from femflex.dynamics.bodies.shapes import columns_times, six_lanes, wrench_times_columns
from femflex.dynamics.joints.motion import accelerate_joint, eliminate_joint, release_root
from femflex.dynamics.joints.prescribed_motion import accelerate_prescribed, write_prescribed_columns
from femflex.dynamics.layout.records import W_ACC, W_CIP, W_M, W_R, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import lane, put_lane
from femflex.kernels.pairs import add_pair, lane_vector, wrench_at_origin
from femflex.kernels.spatial import Rows, add_rows, shifted_rows, turned_rows, weighted
from femflex.kernels.vectors import ZERO, Vector, add, cross, load3, load_rows, store_lane, turn


@inner
def reduce_to_root(table: Table, pool: Array, work: Array, c_d: float, c_k: float, forced: bool) -> None:
    """Tips to root: eliminate every body's elastic block and joint; forced: there are forces on free root joints."""
    for i in range(1, header_of(table)["n_bodies"]):
        write_rows(body_of(table, i), pool, work)
        write_elastic_block(body_of(table, i), pool, work, c_d, c_k)
    reduce_written(table, pool, work, c_d, c_k, forced)


@inner
def reduce_written(table: Table, pool: Array, work: Array, c_d: float, c_k: float, forced: bool) -> None:
    """Tips to root, from rows and elastic blocks that are written already."""
    for i in range(header_of(table)["n_bodies"] - 1, 0, -1):
        b = body_of(table, i)
        if b["own_bends"]:
            refer_to_hinge(b, work)
        if b["n"] > 0:
            eliminate_elastic(b, work, c_d != 0.0 or c_k != 0.0)
        if b["held"]:
            write_prescribed_columns(b, work)
        if forced or not b["full"]:
            eliminate_joint(b, pool, work, c_d, c_k, forced)
        if b["parent"] > 0:
            add_to_parent_rows(b, body_of(table, b["parent"]), work)


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
            if b["held"]:
                accelerate_prescribed(b, work, out)
        if b["n"] > 0:
            accelerate_shapes(b, work, out)


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
            a, alpha = add(a, lane_vector(lift[0])), add(alpha, lane_vector(lift[1]))
        C = load_rows(work, w + W_CIP)
        a, alpha = turn(C, a), turn(C, alpha)
    store_lane(work, w + W_ACC, a)
    store_lane(work, w + W_ACC + 4, alpha, 1.0)


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
