"""Force and torque at a marker, added to the bias of its body, and their work per length on deploying bodies."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import combined, rows3
from femflex.dynamics.layout.records import VARIES, W_P, body_of, header_of
from femflex.dynamics.layout.variations import WORKED
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import lane, put_lane
from femflex.kernels.vectors import Matrix, Vector, add, cross, dot, load3, store_lane, sub, turn_back
from femflex.system.variation import PLACE

Rows = tuple[int, int, int]  # how a marker moves, and the places of its rows phi and psi


@inner
def power_per_length(
    b: Record, force: Vector, torque: Vector, shape: int, spin: int, pool: Array, work: Array
) -> float:
    """Power of a force and of a torque (turned back) at a marker that moves with the length, per unit rate of that."""
    shift, wide = b["unit"] - b["block"], b["wide"]
    velocity = load3(pool, shape - PLACE + 16 + shift)
    velocity = add(velocity, combined(pool, shape + 3 * wide + shift, wide, work, b["delta"]))
    return dot(force, velocity) + dot(torque, combined(pool, spin + 3 * wide + shift, wide, work, b["delta"]))


@inner
def push_on_body(
    b: Record, force: Vector, torque: Vector, r: Vector, T: Matrix, rows: Rows, pool: Array, work: Array
) -> None:
    """Take a force and a torque at a marker off the body's bias: wrench at the origin, phi^T force + (T psi)^T torque.

    All in body components; r from the origin to the marker, T the tangent of its own turn.
    """
    p, row, (bends, shape, spin) = b["work"] + W_P, b["wide"], rows
    store_lane(work, p, sub(load3(work, p), force))
    store_lane(work, p + 4, sub(load3(work, p + 4), add(torque, cross(r, force))))
    if bends:
        torque_on_shapes = turn_back(T, torque)
        for k in range(0, row, 4):
            power = dot(force, rows3(pool, shape + k, row)) + dot(torque_on_shapes, rows3(pool, spin + k, row))
            put_lane(work, b["pn"] + k, lane(work, b["pn"] + k) - power)
        if bends >= VARIES and b["unit"] > 0:
            pool[b["unit"] - WORKED] += power_per_length(b, force, torque_on_shapes, shape, spin, pool, work)


@inner
def clear_work_per_length(table: Table, pool: Array) -> None:
    """Set the work per length [N] of forces at markers of deploying bodies to zero."""
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        if b["unit"] > 0:
            pool[b["unit"] - WORKED] = 0.0
