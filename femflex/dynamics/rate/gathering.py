"""Residual of the equations of motion by gathering forces from tips to root, and the linear solve."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.added_mass import add_added_inertia
from femflex.dynamics.bodies.elastic import write_rows
from femflex.dynamics.bodies.inertia import accelerate_uniformly
from femflex.dynamics.bodies.shapes import columns_times, six_lanes, wrench_times_columns
from femflex.dynamics.bodies.slaves import write_tied_mass
from femflex.dynamics.layout.records import W_ACC, W_BIAS, W_CIN, W_CIP, W_H, W_M, W_P, W_R, W_TAU, body_of, header_of
from femflex.dynamics.rate.recursion import carry_acceleration
from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import lane, plus, put_lane, totals, zero_lane
from femflex.kernels.pairs import Pair, dot_four_rows, dot_pair, pair, pair_of, put_pair, wrench_at_origin
from femflex.kernels.spatial import Rows, six_rows
from femflex.kernels.vectors import ZERO, add, load3, load9, load_rows, scale, store3, turn, turn_back


@inner
def gather_residual(udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """Add the inertia forces of udot to the written biases and gather them on the coordinates."""
    head = header_of(table)
    total = ZERO
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        write_rows(b, pool, work)
        accelerate_body(b, body_of(table, b["parent"]), udot, work)
        add_inertia_forces(b, pool, work)
        w = b["work"]
        total = add(total, turn_back(load9(work, w + W_CIN), load3(work, w + W_P)))
    if body_of(table, 1)["hidden"]:  # the centre of mass stays at O
        a_c = scale(-1.0 / pool[head["mass"]], total)
        store3(work, head["total"] + 3, scale(-1.0, a_c))
        for i in range(1, head["n_bodies"]):
            b = body_of(table, i)
            accelerate_uniformly(b, turn(load9(work, b["work"] + W_CIN), a_c), pool, work)
    for i in range(head["n_bodies"] - 1, 0, -1):
        b = body_of(table, i)
        gather(b, work, out)
        if b["parent"] > 0:
            add_to_parent(b, body_of(table, b["parent"]), work)


@inner
def accelerate_body(b: Record, parent: Record, udot: Array, work: Array) -> None:
    """Write the body's acceleration, that of parent, joint and bias together; and keep those of the shapes."""
    w, hidden = b["work"], 3 if b["hidden"] else 0
    for k in range(b["row"]):
        work[b["accel"] + k] = udot[b["ue"] + k] if k < b["n"] else 0.0
    carry_acceleration(b, parent, work)
    acc = plus(pair(work, w + W_ACC), 1.0, pair(work, w + W_BIAS))
    for k in range(hidden, b["n_h"]):
        acc = plus(acc, udot[b["u"] + k - hidden], pair(work, w + W_H + 8 * k))
    if b["own_bends"]:
        acc = plus(acc, -1.0, columns_times(work, b["G"], b["row"], b["accel"]))
    put_pair(work, w + W_ACC, acc)


@inner
def add_inertia_forces(b: Record, pool: Array, work: Array) -> None:
    """Add A a + B ddot delta to the bias wrench and B^T a + Me ddot delta to the elastic bias."""
    w, n, row, stride, accel = b["work"], b["n"], b["row"], b["stride"], b["accel"]
    acc = pair(work, w + W_ACC)
    force = rows_times_motion(six_rows(work, w + W_M), acc)
    for k in range(n):
        force = plus(force, work[accel + k], pair(work, b["border"] + stride * k + row))
    block, row_stride = b["elastic_mass"], row
    numbers = pool
    if b["n_slaves"]:
        write_tied_mass(b, pool, work)
        block, row_stride, numbers = b["border"], stride, work
    for k in range(0, row, 4):
        elastic = dot_four_rows(work, b["border"] + stride * k + row, stride, acc)
        for j in range(n):
            elastic = elastic + work[accel + j] * lane(numbers, block + row_stride * j + k)
        put_lane(work, b["pn"] + k, elastic)
    if b["added"] > 0:
        add_added_inertia(b, work)
    put_pair(work, w + W_P, force)


@formula
def rows_times_motion(rows: Rows, v: Pair) -> Pair:
    """A a + p of rows [A | p] and v = (a, 1)."""
    products = [row[0] * v[0] + row[1] * v[1] for row in rows]
    force = totals(products[0], products[1], products[2], zero_lane())
    return force, totals(products[3], products[4], products[5], zero_lane())


@inner
def gather(b: Record, work: Array, out: Array) -> None:
    """Write the body's rows of the residual from its wrench and its elastic forces."""
    w, hidden = b["work"], 3 if b["hidden"] else 0
    force = (lane(work, w + W_P), lane(work, w + W_P + 4))
    for k in range(hidden, b["n_h"]):
        along_joint = dot_pair(force, pair(work, w + W_H + 8 * k))
        out[b["u"] + k - hidden] = along_joint - (work[w + W_TAU + k - hidden] if b["sprung"] else 0.0)
    if b["own_bends"]:
        for k in range(0, b["row"], 4):
            put_lane(
                work,
                b["pn"] + k,
                lane(work, b["pn"] + k) - wrench_times_columns(force, six_lanes(work, b["G"] + k, b["row"])),
            )
    for k in range(b["n"]):
        out[b["ue"] + k] = work[b["pn"] + k]


@inner
def add_to_parent(b: Record, parent: Record, work: Array) -> None:
    """Add the body's wrench to its parent's, and through the node that carries the joint to its elastic forces."""
    w, p, row = b["work"], parent["work"] + W_P, parent["row"]
    C = load_rows(work, w + W_CIP)
    f, m = turn_back(C, load3(work, w + W_P)), turn_back(C, load3(work, w + W_P + 4))
    force = pair_of(f, m)
    put_pair(work, p, plus(pair(work, p), 1.0, wrench_at_origin(force, load3(work, w + W_R))))
    if b["bends"]:
        for k in range(0, row, 4):
            entry = parent["pn"] + k
            put_lane(work, entry, lane(work, entry) + wrench_times_columns(force, six_lanes(work, b["Phi"] + k, row)))
