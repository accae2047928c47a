"""Rows run through the factors of the recursion, and the motion that multipliers give, in O(n) each.

The recursion from the tips to the root factorises M = L D L^T, D diagonal. With the white row w_i = D^-1/2 L^-1 a_i of
row a_i, a_i . M^-1 a_j = w_i . w_j, so that no row needs a way back from the root to the tips. With the stiff part in
the recursion the same holds for S = M + c_d D + c_k K.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.inertia import zero_forces
from femflex.dynamics.bodies.shapes import six_lanes, wrench_times_columns
from femflex.dynamics.constraints.rows import push_row, row_of
from femflex.dynamics.forces.forces import clear_forces, clear_joint_forces, push_coordinates
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraint_records import closing_of, constraint_of
from femflex.dynamics.layout.records import W_H, W_P, W_PIVOT, W_TAU, W_U, body_of, header_of
from femflex.dynamics.rate.gathering import add_to_parent
from femflex.dynamics.rate.recursion import accelerate
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import lane, offset, plus, put_lane
from femflex.kernels.pairs import Pair, dot_pair, pair, put_pair


@inner
def white_row_shift(b: Record, closing: Record) -> int:
    """Return the addend to b["u"] for the body's first joint freedom in a white row; hidden slides come first."""
    return 0 if b["hidden"] else closing["n_hidden"]


@inner
def is_plain(b: Record, stiff: bool) -> bool:
    """Whether the body's elastic block is the unit matrix."""
    return b["orthonormal"] == 1 and b["dense"] == 0 and not stiff


@inner
def write_pivot_roots(table: Table, work: Array, stiff: bool) -> None:
    """Write the roots of all reciprocal pivots of the recursion; zero for prescribed freedoms."""
    closing = closing_of(table)
    roots = closing["roots"]
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        first, shapes = roots + b["u"] + white_row_shift(b, closing), roots + b["ue"] + closing["n_hidden"]
        for k in range(b["n_h"]):
            work[first + k] = math.sqrt(work[b["work"] + W_PIVOT + k])
        for k in range(b["n"]):
            work[shapes + k] = 1.0 if is_plain(b, stiff) else math.sqrt(work[b["pivot"] + k])


@inner
def mark_path(i: int, marks: int, table: Table, work: Array) -> None:
    """Mark body i and all bodies between it and the root."""
    while i > 0 and work[marks + i] == 0.0:
        work[marks + i] = 1.0
        i = body_of(table, i)["parent"]


@inner
def whiten_rows(table: Table, work: Array, stiff: bool) -> None:
    """Write the white row of every constraint row; the bodies' forces are used up."""
    write_pivot_roots(table, work, stiff)
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        for k in range(c["n_rows"]):
            whiten_row(c, k, table, work, stiff)


@inner
def whiten_row(c: Record, k: int, table: Table, work: Array, stiff: bool) -> None:
    """Write the white row of row k of a constraint: only bodies between its markers and the root have a part in it."""
    marks = closing_of(table)["marks"]
    general = c["kind"] == layout.CONSTRAINT_GENERAL
    for j in range(1, header_of(table)["n_bodies"]):
        work[marks + j] = 1.0 if general else 0.0
    if general:
        clear_marked(table, work)
        push_coordinates(offset(work, c["general"] + k * header_of(table)["n_u"]), table, work)
    else:
        mark_path(c["parent"], marks, table, work)
        mark_path(c["child"], marks, table, work)
        clear_marked(table, work)
        push_row(c, row_of(table, c["first"] + k), 1.0, table, work)
    reduce_forces(c["first"] + k, table, work, stiff)


@inner
def clear_marked(table: Table, work: Array) -> None:
    """Leave marked bodies without forces and joint forces."""
    for j in range(1, header_of(table)["n_bodies"]):
        if work[closing_of(table)["marks"] + j] != 0.0:
            zero_forces(body_of(table, j), work)
            clear_joint_forces(body_of(table, j), work)


@inner
def reduce_forces(i: int, table: Table, work: Array, stiff: bool) -> None:
    """Write white row i from the forces on the marked bodies, and clear these."""
    closing = closing_of(table)
    white = offset(work, closing["white"] + closing["width"] * i)
    for j in range(closing["width"]):
        white[j] = 0.0
    for j in range(header_of(table)["n_bodies"] - 1, 0, -1):
        if work[closing["marks"] + j] != 0.0:
            b = body_of(table, j)
            reduce_body(b, closing, white, work, stiff)
            if b["parent"] > 0:
                add_to_parent(b, body_of(table, b["parent"]), work)


@inner
def reduce_body(b: Record, closing: Record, white: Array, work: Array, stiff: bool) -> None:
    """Eliminate a body's shapes and joint from its forces with the recursion's factors, leaving the rest in W_P."""
    w, row, roots = b["work"], b["row"], closing["roots"]
    force = pair(work, w + W_P)
    if b["own_bends"]:
        for k in range(0, row, 4):
            put_lane(
                work,
                b["pn"] + k,
                lane(work, b["pn"] + k) - wrench_times_columns(force, six_lanes(work, b["G"] + k, row)),
            )
    if b["n"] > 0:
        first = b["ue"] + closing["n_hidden"]
        force = reduce_shapes(b, force, offset(white, first), offset(work, roots + first), work, stiff)
    hidden, first = 3 if b["hidden"] else 0, b["u"] + white_row_shift(b, closing)
    for k in range(b["n_h"]):
        remaining = -dot_pair(pair(work, w + W_H + 8 * k), force)
        if k >= hidden:
            remaining += work[w + W_TAU + k - hidden]
        white[first + k] = work[roots + first + k] * remaining
        force = plus(force, work[w + W_PIVOT + k] * remaining, pair(work, w + W_U + 8 * k))
    put_pair(work, w + W_P, force)


@inner
def reduce_shapes(b: Record, force: Pair, white: Array, roots: Array, work: Array, stiff: bool) -> Pair:
    """Return the wrench less the part of the shapes, and write the shapes' part of the white row."""
    n, row, stride, border, pn = b["n"], b["row"], b["stride"], b["border"], b["pn"]
    plain = is_plain(b, stiff)
    for i in range(n):
        total = -work[pn + i]
        force = plus(force, total, pair(work, border + stride * i + row))
        if not plain:
            for j in range(i):
                total -= work[border + stride * j + i] * roots[j] * white[j]
        white[i] = roots[i] * total
    return force


@inner
def write_response(table: Table, work: Array, out: Array, stiff: bool) -> None:
    """out = M^-1 A^T lambda (n_u) of the multipliers, from the white rows: one way from the root to the tips.

    stiff: with S for M.
    """
    head, closing = header_of(table), closing_of(table)
    clear_forces(table, work)
    if head["n_holds"] > 0:
        for k in range(head["n_u"]):
            work[head["known"] + k] = 0.0
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        first, shapes = b["u"] + white_row_shift(b, closing), b["ue"] + closing["n_hidden"]
        for k in range(b["n_h"]):
            root = work[closing["roots"] + first + k]
            work[b["work"] + W_U + 8 * k + 7] = 0.0 if root == 0.0 else -combination(first + k, table, work) / root
        if b["n"] > 0:
            substitute_shapes(b, shapes, closing, table, work, stiff)
    accelerate(table, work, out, True)


@inner
def combination(j: int, table: Table, work: Array) -> float:
    """Entry j of the white rows' sum, each times its multiplier."""
    closing = closing_of(table)
    total = 0.0
    for i in range(closing["n_rows"]):
        total += work[row_of(table, i) + layout.R_LAMBDA] * work[closing["white"] + closing["width"] * i + j]
    return total


@inner
def substitute_shapes(b: Record, first: int, closing: Record, table: Table, work: Array, stiff: bool) -> None:
    """Write E^-1 pn of the multipliers' forces to the last place of the elastic rows."""
    n, row, stride, border = b["n"], b["row"], b["stride"], b["border"]
    plain = is_plain(b, stiff)
    for i in range(n - 1, -1, -1):
        root = work[closing["roots"] + first + i]
        total = combination(first + i, table, work)
        if not plain:
            for j in range(i + 1, n):
                total += root * work[border + stride * i + j] * work[border + stride * j + row + 7]
        work[border + stride * i + row + 7] = -root * total
