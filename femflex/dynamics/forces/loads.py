"""Loads at markers, constant or tabulated in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import inner
from femflex.dynamics.arithmetic.lanes import lane, put
from femflex.dynamics.arithmetic.section_turns import section_slope, section_vector
from femflex.dynamics.arithmetic.turns import vector_tangent, vector_turn
from femflex.dynamics.arithmetic.vectors import (
    UNIT,
    ZERO,
    Matrix,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    product,
    scale,
    store_lane,
    sub,
    turn,
    turn_back,
)
from femflex.dynamics.bodies.shapes import combined, rows3
from femflex.dynamics.lowering.layout import (
    LOAD_BODY,
    LOAD_INERTIAL,
    LOAD_MARKER,
    ORBIT_NONE,
    TURNS,
    VARIES,
    W_CIN,
    W_P,
    W_POS,
    body_of,
    header_of,
    load_of,
)

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void


@inner
def tabulated(t: float, load: Record, pool: Array) -> tuple[Vector, Vector]:
    """Force and torque of a load at t: linear between the times, zero outside, a repeated time is a jump."""
    n, times, values = load["n_times"], load["times"], load["values"]
    if n == 0:
        return load3(pool, values), load3(pool, values + 3)
    if t < pool[times] or t > pool[times + n - 1]:
        return ZERO, ZERO
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if pool[times + middle] <= t:
            low = middle
        else:
            high = middle
    t0, t1 = pool[times + low], pool[times + high]
    s = 1.0 if t1 == t0 else (t - t0) / (t1 - t0)
    before, after = values + 6 * low, values + 6 * high
    force = add(scale(1.0 - s, load3(pool, before)), scale(s, load3(pool, after)))
    return force, add(scale(1.0 - s, load3(pool, before + 3)), scale(s, load3(pool, after + 3)))


@inner
def load_wrench(
    t: float, load: Record, table: Table, pool: Array, work: Array
) -> tuple[Vector, Vector, Vector, Matrix]:
    """Force, torque and place of a load, and the tangent T of its marker's turn, all in body components."""
    b = body_of(table, load["body"])
    C_iN = load9(work, b["work"] + W_CIN)
    force, torque = tabulated(t, load, pool)
    r = load3(pool, load["place"])
    C_iM = load9(pool, load["place"] + 3)
    T = UNIT
    if load["bends"]:
        r = add(r, combined(pool, load["shape"], b["wide"], work, b["delta"]))
        theta = combined(pool, load["spin"], b["wide"], work, b["delta"])
        if load["bends"] == TURNS or load["bends"] == VARIES + TURNS:
            e = load3(pool, load["place"] + 12)
            F, theta = section_slope(e, theta), section_vector(e, theta)
            T = product(vector_tangent(theta), F)
        else:
            T = vector_tangent(theta)
        C_iM = product(vector_turn(theta), C_iM)
    if load["frame"] == LOAD_MARKER:
        C = C_iM
    elif load["frame"] == LOAD_INERTIAL:
        C = C_iN
    elif load["frame"] == LOAD_BODY:
        C = UNIT
    else:
        C = product(C_iN, load9(work, header_of(table)["orbit_state"] + 4))
    return turn(C, force), turn(C, torque), r, T


@inner
def energy_of_loads(t: float, shift: Vector, table: Table, pool: Array, work: Array) -> float:
    """Potential energy -F.r of the loads that have one: forces constant in inertial axes, with no torque, in no orbit.

    r of the marker from `shift`, inertial components.
    """
    energy, head = 0.0, header_of(table)
    for i in range(head["n_loads"] if head["orbit"] == ORBIT_NONE else 0):
        load = load_of(table, i)
        if load["n_times"] == 0 and load["frame"] == LOAD_INERTIAL:
            force, torque, r, _ = load_wrench(t, load, table, pool, work)
            w = body_of(table, load["body"])["work"]
            at = add(r, turn(load9(work, w + W_CIN), sub(load3(work, w + W_POS), shift)))
            energy -= dot(force, at) if dot(torque, torque) == 0.0 else 0.0
    return energy


@inner
def apply_load(t: float, load: Record, table: Table, pool: Array, work: Array) -> None:
    """Take a load off the bias of its body."""
    force, torque, r, T = load_wrench(t, load, table, pool, work)
    push(body_of(table, load["body"]), force, torque, r, T, load["bends"], load["shape"], load["spin"], pool, work)


@inner
def push(
    b: Record,
    force: Vector,
    torque: Vector,
    r: Vector,
    T: Matrix,
    bends: int,
    shape: int,
    spin: int,
    pool: Array,
    work: Array,
) -> None:
    """Take a force and a torque at a marker off the body's bias: wrench at the origin, phi^T force + (T psi)^T torque.

    All in body components; r from the origin to the marker, T the tangent of its own turn.
    """
    p, row = b["work"] + W_P, b["wide"]
    store_lane(work, p, sub(load3(work, p), force))
    store_lane(work, p + 4, sub(load3(work, p + 4), add(torque, cross(r, force))))
    if bends:
        turned = turn_back(T, torque)
        for k in range(0, row, 4):
            power = dot(force, rows3(pool, shape + k, row)) + dot(turned, rows3(pool, spin + k, row))
            put(work, b["pn"] + k, lane(work, b["pn"] + k) - power)
