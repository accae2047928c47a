"""Springs between two markers: forces along the line that joins them, and their energy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.shapes import combined, marker_velocity
from femflex.dynamics.forces.force_term import ForceTerm, Records
from femflex.dynamics.forces.forces import APPLY, REPORT, account_of
from femflex.dynamics.forces.marker_forces import push_on_body
from femflex.dynamics.layout.constraint_records import ENDS
from femflex.dynamics.layout.constraints import lower_ends
from femflex.dynamics.layout.pool import Pool, Scratch
from femflex.dynamics.layout.records import (
    A_DISSIPATION,
    A_ENERGY,
    ENERGY_SPRING,
    W_CIN,
    W_OMEGA,
    W_POS,
    W_VEL,
    body_of,
    record_reader,
)
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.vectors import UNIT, ZERO, Vector, add, cross, dot, load3, load9, scale, sub, turn, turn_back
from femflex.system import Channel, System

SPRING = np.dtype([(name, "i8") for name in (*ENDS, "data")])  # pool: stiffness, damping, free length
N_SPRING = len(SPRING.names or ())

spring_at = record_reader(SPRING)

NO_LENGTH = 1e-150  # m, below which the line has no direction and the spring no force


@inner
def end_motion(
    b: Record, marker: int, shape: int, bends: int, pool: Array, work: Array
) -> tuple[Vector, Vector, Vector]:
    """A marker's place from its body's origin, body components; its place and velocity, inertial components."""
    w = b["work"]
    C_iN = load9(work, w + W_CIN)
    r, v = load3(pool, marker), load3(work, w + W_VEL)
    if bends:
        r = add(r, combined(pool, shape, b["wide"], work, b["delta"]))
        v = add(v, marker_velocity(pool, marker, shape, bends, b, work))
    v = add(v, cross(load3(work, w + W_OMEGA), r))
    return r, add(load3(work, w + W_POS), turn_back(C_iN, r)), turn_back(C_iN, v)


@inner
def spring_geometry(s: Record, table: Table, pool: Array, work: Array) -> tuple[Vector, Vector, Vector, float, float]:
    """Places of P and Q on their bodies, the unit vector from P to Q (inertial components), distance, and its rate."""
    P, Q = body_of(table, s["parent"]), body_of(table, s["child"])
    r_P, p, v_P = end_motion(P, s["place_P"], s["shape_P"], s["bends_P"], pool, work)
    r_Q, q, v_Q = end_motion(Q, s["place_Q"], s["shape_Q"], s["bends_Q"], pool, work)
    d = sub(q, p)
    length = math.sqrt(dot(d, d))
    if length < NO_LENGTH:
        return r_P, r_Q, ZERO, 0.0, 0.0
    e = scale(1.0 / length, d)
    return r_P, r_Q, e, length, dot(e, sub(v_Q, v_P))


@inner
def tension(data: int, length: float, speed: float, pool: Array) -> float:
    """Force with which a spring and its damper pull their ends together, [N]."""
    return pool[data] * (length - pool[data + 2]) + pool[data + 1] * speed


@inner
def apply_spring(s: Record, table: Table, pool: Array, work: Array) -> None:
    """Put the force of a spring on its two bodies."""
    r_P, r_Q, e, length, speed = spring_geometry(s, table, pool, work)
    pull = tension(s["data"], length, speed, pool)
    P, Q = body_of(table, s["parent"]), body_of(table, s["child"])
    if s["parent"] > 0:
        force = scale(pull, turn(load9(work, P["work"] + W_CIN), e))
        push_on_body(P, force, ZERO, r_P, UNIT, (s["bends_P"], s["shape_P"], s["spin_P"]), pool, work)
    force = scale(-pull, turn(load9(work, Q["work"] + W_CIN), e))
    push_on_body(Q, force, ZERO, r_Q, UNIT, (s["bends_Q"], s["shape_Q"], s["spin_Q"]), pool, work)


@entry(APPLY)
def apply(
    t: float, q: Array, u: Array, records: int, first: int, last: int, table: Table, pool: Array, work: Array
) -> None:
    """Put the forces of springs on their bodies."""
    for i in range(first, last):
        apply_spring(spring_at(table, records + N_SPRING * i), table, pool, work)


@entry(REPORT)
def report(
    t: float, q: Array, u: Array, records: int, n: int, row: Array, table: Table, pool: Array, work: Array
) -> None:
    """Length and tension of every spring; energy stored in all of them, and the power that their dampers take."""
    account = account_of(table, work)
    for i in range(n):
        s = spring_at(table, records + N_SPRING * i)
        data = s["data"]
        _, _, _, length, speed = spring_geometry(s, table, pool, work)
        row[2 * i] = length
        row[2 * i + 1] = tension(data, length, speed, pool)
        account[A_ENERGY] += 0.5 * pool[data] * (length - pool[data + 2]) ** 2
        account[A_DISSIPATION] += pool[data + 1] * speed * speed


class Springs(ForceTerm):
    """The springs between markers of a system."""

    folder, energy = "springs", ENERGY_SPRING
    apply, report = apply, report

    def items(self, system: System) -> list[str]:
        return [spring.name for spring in system.springs]

    def lower(self, system: System, head: Record, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Records:
        records = np.zeros(len(system.springs), SPRING)
        for record, spring in zip(records, system.springs, strict=True):
            lower_ends(record, ((spring.parent, spring.parent_marker), (spring.body, spring.marker)), system, pool)
            record["data"] = pool.add([spring.stiffness, spring.damping, spring.length])
        return records

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for spring in system.springs:
            out[f"springs/{spring.name}/length"] = Channel("m", f"distance between the ends of {spring.name}")
            out[f"springs/{spring.name}/tension"] = Channel("N", f"pull of {spring.name} on its ends")
        return out

    def without_item(self, system: System, item: str) -> System:
        return replace(system, springs=tuple(spring for spring in system.springs if spring.name != item))
