"""Loads at markers, constant or tabulated in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import combined, marker_velocity
from femflex.dynamics.forces.force_term import ForceTerm, Records
from femflex.dynamics.forces.forces import APPLY, REPORT, account_of
from femflex.dynamics.forces.marker_forces import push_on_body
from femflex.dynamics.layout.pool import Pool, Scratch, add_marker
from femflex.dynamics.layout.records import (
    A_DRIFT,
    A_ENERGY,
    A_SHIFT,
    A_SUPPLIED,
    ENERGY_LOAD,
    ORBIT_NONE,
    TURNS,
    VARIES,
    W_CIN,
    W_OMEGA,
    W_POS,
    W_VEL,
    body_of,
    header_of,
    record_reader,
)
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.section_turns import section_slope, section_vector
from femflex.kernels.turns import vector_tangent, vector_turn
from femflex.kernels.vectors import (
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
    store3,
    sub,
    turn,
)
from femflex.system import Channel, Load, System

LOAD = np.dtype(
    [
        (name, "i8")
        for name in (
            "body",
            "frame",  # LOAD_*
            "place", "shape", "spin", "bends",  # as for marker P
            "n_times",  # 0: constant
            "times", "values",  # pool (n_times,), (n_times | 1, 6): force, torque
        )
    ]
)  # fmt: skip
N_LOAD = len(LOAD.names or ())
LOAD_BODY, LOAD_MARKER, LOAD_INERTIAL, LOAD_ORBITAL = 0, 1, 2, 3
CODES = {"body": LOAD_BODY, "marker": LOAD_MARKER, "inertial": LOAD_INERTIAL, "orbital": LOAD_ORBITAL}
XYZ = ("x", "y", "z")

load_at = record_reader(LOAD)


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
def has_potential(load: Record, torque: Vector, head: Record) -> bool:
    """Whether a load has a potential: a force constant in inertial axes, with no torque, in no orbit."""
    constant = load["n_times"] == 0 and load["frame"] == LOAD_INERTIAL
    return bool(head["orbit"] == ORBIT_NONE and constant and dot(torque, torque) == 0.0)


@inner
def energy_of_load(force: Vector, r: Vector, shift: Vector, w: int, work: Array) -> float:
    """Potential energy -F.r of a load that has one; r of the marker from `shift`, inertial components."""
    return -dot(force, add(r, turn(load9(work, w + W_CIN), sub(load3(work, w + W_POS), shift))))


@inner
def power_of_load(
    load: Record, wrench: tuple[Vector, Vector, Vector, Matrix], drift: Vector, b: Record, pool: Array, work: Array
) -> float:
    """F.v + T.omega at the marker of a load, velocities counted from `drift` (inertial components)."""
    force, torque, r, T = wrench
    w = b["work"]
    omega = load3(work, w + W_OMEGA)
    v = add(sub(load3(work, w + W_VEL), turn(load9(work, w + W_CIN), drift)), cross(omega, r))
    if load["bends"]:
        wide = b["wide"]
        v = add(v, marker_velocity(pool, load["place"], load["shape"], load["bends"], b, work))
        spin = combined(pool, load["spin"], wide, work, b["ddelta"])
        if load["bends"] >= VARIES:
            spin = add(spin, combined(pool, load["spin"] + 3 * wide, wide, work, b["delta"]))
        omega = add(omega, turn(T, spin))
    return dot(force, v) + dot(torque, omega)


@entry(APPLY)
def apply(
    t: float, q: Array, u: Array, records: int, first: int, last: int, table: Table, pool: Array, work: Array
) -> None:
    """Put loads on their bodies."""
    for i in range(first, last):
        load = load_at(table, records + N_LOAD * i)
        force, torque, r, T = load_wrench(t, load, table, pool, work)
        rows = load["bends"], load["shape"], load["spin"]
        push_on_body(body_of(table, load["body"]), force, torque, r, T, rows, pool, work)


@entry(REPORT)
def report(
    t: float, q: Array, u: Array, records: int, n: int, row: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write force and torque of every load, body components, and its power; add its part to energy or supply."""
    head, account = header_of(table), account_of(table, work)
    shift, drift = load3(account, A_SHIFT), load3(account, A_DRIFT)
    for i in range(n):
        load = load_at(table, records + N_LOAD * i)
        force, torque, r, T = load_wrench(t, load, table, pool, work)
        store3(row, 7 * i, force)
        store3(row, 7 * i + 3, torque)
        b = body_of(table, load["body"])
        power = power_of_load(load, (force, torque, r, T), drift, b, pool, work)
        row[7 * i + 6] = power
        if has_potential(load, torque, head):
            account[A_ENERGY] += energy_of_load(force, r, shift, b["work"], work)
        else:
            account[A_SUPPLIED] += power


class Loads(ForceTerm):
    """The loads of a system."""

    folder, energy = "loads", ENERGY_LOAD
    apply, report = apply, report

    def items(self, system: System) -> list[str]:
        return [load.name for load in system.loads]

    def lower(self, system: System, head: Record, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Records:
        return np.array([lowered(load, system, pool) for load in system.loads], LOAD)

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for load in system.loads:
            for key, unit, value in (("force", "N", load.force), ("torque", "N m", load.torque)):
                text = f"{key} of {load.name}"
                out[f"loads/{load.name}/{key}"] = Channel(unit, text, (3,), XYZ, "body", reported=bool(value.any()))
            out[f"loads/{load.name}/power"] = Channel("W", f"power of {load.name}")
        return out

    def without_item(self, system: System, item: str) -> System:
        return replace(system, loads=tuple(load for load in system.loads if load.name != item))

    def breaks(self, system: System) -> list[Array]:
        return [load.times for load in system.loads if load.times is not None]


def lowered(load: Load, system: System, pool: Pool) -> NDArray[np.void]:
    """One LOAD record."""
    record = np.zeros((), LOAD)
    record["body"], record["frame"] = 1 + system.order.index(load.body), CODES[load.frame]
    record["place"], record["shape"], record["spin"], record["bends"] = add_marker(load.body, load.marker, system, pool)
    record["n_times"] = 0 if load.times is None else len(load.times)
    record["times"] = pool.add(np.zeros(1) if load.times is None else load.times)
    record["values"] = pool.add(np.hstack([np.atleast_2d(load.force), np.atleast_2d(load.torque)]))
    return record
