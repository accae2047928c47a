"""Laws of joint freedoms and elastic latches: resisting forces, and the energy they store.

Numbers of a law: a potential V(q), Rayleigh's R(u) or a damping c(q) as piecewise polynomials (see profiles); limit and
velocity scale of friction; stiffness, damping and place of an elastic latch; parameters of a law with a function.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from femflex.arrays import Array, Record, Table
from femflex.dynamics.forces.force_term import ForceTerm, Records
from femflex.dynamics.forces.forces import APPLY, REPORT, RESIST, account_of
from femflex.dynamics.joints.places import law_places
from femflex.dynamics.layout.pool import Pool, Scratch
from femflex.dynamics.layout.records import (
    A_DISSIPATION,
    A_ENERGY,
    ENERGY_SPRING,
    W_RESIST,
    W_TAU,
    body_of,
    header_of,
    record_reader,
)
from femflex.kernels.compiled import inner
from femflex.kernels.entries import LAW_FUNCTION, Entry, caller, entry
from femflex.kernels.lanes import offset, put_lane, zero_lane
from femflex.kernels.profiles import profile_at
from femflex.kernels.vectors import Vector
from femflex.system import Channel, Joint, Latch, System
from femflex.system.law import CALLED, CONTACT, DAMPER, FRICTION, GIVEN, LATCHED, SPRING

LAW = np.dtype(
    [
        (name, "i8")
        for name in (
            "body", "freedom",  # whose joint, and which freedom of it
            "q", "u",  # the freedom's place in the state
            "kind", "numbers",  # of a piece of the law; pool (see above)
            "latch",  # place in z of a latch's time: acts from then on; -1 without
            "item",  # number of the law, or elastic latch, whose piece this is
            "act", "out",  # of a law with a function: its address, and where in work it writes (system.law.GIVEN)
        )
    ]
)  # fmt: skip
N_LAW = len(LAW.names or ())

law_at = record_reader(LAW)
call_law = caller(LAW_FUNCTION)
FORCE, ENERGY, DISSIPATION, STIFFNESS, DAMPING = range(len(GIVEN))


@inner
def elastic_law(law: Record, q: Array, z: Array, pool: Array) -> Vector:
    """V, V' and V'' of a law's potential at its coordinate; zero for a law without one."""
    x, numbers = q[law["q"]], law["numbers"]
    if law["kind"] == SPRING:
        return profile_at(x, numbers, pool)
    if law["kind"] != LATCHED or z[law["latch"]] < 0.0:
        return 0.0, 0.0, 0.0
    k, stretch = pool[numbers], x - pool[numbers + 2]
    return 0.5 * k * stretch * stretch, k * stretch, k


@inner
def call_function(law: Record, q: Array, u: Array, pool: Array, work: Array) -> int:
    """Call the function of a law, and return where in work it has written."""
    out = law["out"]
    put_lane(work, out, zero_lane())
    put_lane(work, out + 4, zero_lane())
    call_law(law["act"], q[law["q"]], u[law["u"]], offset(pool, law["numbers"]), offset(work, out))
    return int(out)


@inner
def law_force(law: Record, q: Array, u: Array, z: Array, pool: Array, work: Array) -> float:
    """Resisting force of a law."""
    x, rate, numbers = q[law["q"]], u[law["u"]], law["numbers"]
    force = elastic_law(law, q, z, pool)[1]
    if law["kind"] == DAMPER:
        force += profile_at(rate, numbers, pool)[1]
    elif law["kind"] == CONTACT:
        force += profile_at(x, numbers, pool)[0] * rate
    elif law["kind"] == FRICTION:
        force += pool[numbers] * math.tanh(rate / pool[numbers + 1])
    elif law["kind"] == LATCHED and z[law["latch"]] >= 0.0:
        force += pool[numbers + 1] * rate
    elif law["kind"] == CALLED:
        force = work[call_function(law, q, u, pool, work) + FORCE]
    return force


@inner
def law_slopes(law: Record, q: Array, u: Array, z: Array, pool: Array, work: Array) -> tuple[float, float]:
    """Slopes of a law's force, by its coordinate and by its rate."""
    x, rate, numbers = q[law["q"]], u[law["u"]], law["numbers"]
    stiffness, drag = elastic_law(law, q, z, pool)[2], 0.0
    if law["kind"] == DAMPER:
        drag = profile_at(rate, numbers, pool)[2]
    elif law["kind"] == CONTACT:
        c = profile_at(x, numbers, pool)
        stiffness, drag = stiffness + c[1] * rate, c[0]
    elif law["kind"] == FRICTION:
        slip = math.tanh(rate / pool[numbers + 1])
        drag = pool[numbers] / pool[numbers + 1] * (1.0 - slip * slip)
    elif law["kind"] == LATCHED and z[law["latch"]] >= 0.0:
        drag = pool[numbers + 1]
    elif law["kind"] == CALLED:
        out = call_function(law, q, u, pool, work)
        stiffness, drag = work[out + STIFFNESS], work[out + DAMPING]
    return stiffness, drag


@inner
def first_piece(table: Table, start: int) -> int:
    """Return the start of the LAW records, which follow their number."""
    return start + 1


@entry(APPLY)
def apply(
    t: float, q: Array, u: Array, start: int, first: int, last: int, table: Table, pool: Array, work: Array
) -> None:
    """Take the forces of laws off the forces of their joints."""
    z = offset(work, header_of(table)["z"])
    for j in range(table[start]):
        law = law_at(table, first_piece(table, start) + N_LAW * j)
        if first <= law["item"] < last:
            tau = body_of(table, law["body"])["work"] + W_TAU + law["freedom"]
            work[tau] -= law_force(law, q, u, z, pool, work)


@entry(RESIST)
def resist(
    t: float, q: Array, u: Array, c_d: float, c_k: float, start: int, n: int, table: Table, pool: Array, work: Array
) -> None:
    """Add the slopes of the laws' forces, each where it is not negative."""
    z = offset(work, header_of(table)["z"])
    for j in range(table[start]):
        law = law_at(table, first_piece(table, start) + N_LAW * j)
        stiffness, drag = law_slopes(law, q, u, z, pool, work)
        entry = body_of(table, law["body"])["work"] + W_RESIST + law["freedom"]
        work[entry] += c_d * max(0.0, drag) + c_k * max(0.0, stiffness)


@entry(REPORT)
def report(
    t: float, q: Array, u: Array, start: int, n: int, row: Array, table: Table, pool: Array, work: Array
) -> None:
    """Force of every law and elastic latch, the energy they store, and the power they take."""
    z, account = offset(work, header_of(table)["z"]), account_of(table, work)
    for i in range(n):
        row[i] = 0.0
    for j in range(table[start]):
        law = law_at(table, first_piece(table, start) + N_LAW * j)
        force, (energy, elastic, _) = law_force(law, q, u, z, pool, work), elastic_law(law, q, z, pool)
        lost = (force - elastic) * u[law["u"]]
        if law["kind"] == CALLED:
            energy, lost = work[law["out"] + ENERGY], work[law["out"] + DISSIPATION]
        row[law["item"]] += force
        account[A_ENERGY] += energy
        account[A_DISSIPATION] += lost


class Laws(ForceTerm):
    """The laws and elastic latches of joint freedoms."""

    folder, energy = "laws", ENERGY_SPRING
    apply, report, resist = apply, report, resist

    def items(self, system: System) -> list[str]:
        return [entry.name for entry in law_places(system)]

    def lower(self, system: System, head: Record, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Table:
        pieces: list[tuple[int, ...]] = []
        for item, law_place in enumerate(law_places(system)):
            i, k = 1 + system.order.index(law_place.joint.child), law_place.law.freedom
            for kind, numbers in law_place.law.pieces():
                act = law_entry(type(law_place.law).act).address if kind == CALLED else 0
                out = scratch.take(len(GIVEN)) if kind == CALLED else 0
                place = i, k, law_place.q, law_place.u
                pieces.append((*place, kind, pool.add(numbers), law_place.time, item, act, out))
            bodies[i]["sprung"], bodies[i]["lawful"], bodies[i]["full"] = 1, 1, 0
        return np.array([len(pieces), *(number for piece in pieces for number in piece)], np.int64)

    def channels(self, system: System) -> dict[str, Channel]:
        return {
            f"laws/{law_place.name}/force": Channel(law_place.unit, f"resisting force or torque of {law_place.name}")
            for law_place in law_places(system)
        }

    def without_item(self, system: System, item: str) -> System:
        return replace(system, joints=tuple(without_law(joint, item) for joint in system.joints))

    def fixed(self, system: System) -> list[str]:
        return [law_place.name for law_place in law_places(system) if isinstance(law_place.law, Latch)]


@cache
def law_entry(function: Callable[..., None]) -> Entry:
    """The compiled function of a law."""
    return Entry(function, LAW_FUNCTION)


def without_law(joint: Joint, name: str) -> Joint:
    """The joint without the law of that name; itself when it has none."""
    laws = [
        law.model_copy(update={"name": law_name})
        for law, law_name in zip(joint.laws, joint.law_names(), strict=True)
        if law_name != name
    ]  # the others keep their names
    return replace(joint, laws=tuple(laws)) if len(laws) < len(joint.laws) else joint
