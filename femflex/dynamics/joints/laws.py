"""Laws of joint freedoms in the compiled model: resisting forces, and the energy they store.

Numbers of a law: a potential V(q), Rayleigh's R(u) or a damping c(q) as piecewise polynomials (see profiles); limit and
velocity scale of friction; stiffness, damping and place of an elastic latch.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import inner
from femflex.dynamics.arithmetic.profiles import profile_at
from femflex.dynamics.arithmetic.vectors import Vector
from femflex.dynamics.lowering.layout import W_RESIST, W_TAU, body_of, header_of, law_of
from femflex.system.law import CONTACT, DAMPER, FRICTION, LATCHED, SPRING

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void


@inner
def elastic_law(law: Record, q: Array, pool: Array) -> Vector:
    """V, V' and V'' of a law's potential at its coordinate; zero for a law without one."""
    x, at = q[law["q"]], law["numbers"]
    if law["kind"] == SPRING:
        return profile_at(x, at, pool)
    if law["kind"] != LATCHED or q[law["latch"]] < 0.0:
        return 0.0, 0.0, 0.0
    k, stretch = pool[at], x - pool[at + 2]
    return 0.5 * k * stretch * stretch, k * stretch, k


@inner
def law_force(law: Record, q: Array, u: Array, pool: Array) -> float:
    """Resisting force of a law."""
    x, rate, at = q[law["q"]], u[law["u"]], law["numbers"]
    force = elastic_law(law, q, pool)[1]
    if law["kind"] == DAMPER:
        force += profile_at(rate, at, pool)[1]
    elif law["kind"] == CONTACT:
        force += profile_at(x, at, pool)[0] * rate
    elif law["kind"] == FRICTION:
        force += pool[at] * math.tanh(rate / pool[at + 1])
    elif law["kind"] == LATCHED and q[law["latch"]] >= 0.0:
        force += pool[at + 1] * rate
    return force


@inner
def add_law_forces(q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Take the laws' forces off the joints' forces."""
    for j in range(header_of(table)["n_laws"]):
        law = law_of(table, j)
        tau = body_of(table, law["body"])["work"] + W_TAU + law["freedom"]
        work[tau] -= law_force(law, q, u, pool)


@inner
def law_slopes(law: Record, q: Array, u: Array, pool: Array) -> tuple[float, float]:
    """Slopes of a law's force, by its coordinate and by its rate."""
    x, rate, at = q[law["q"]], u[law["u"]], law["numbers"]
    stiffness, drag = elastic_law(law, q, pool)[2], 0.0
    if law["kind"] == DAMPER:
        drag = profile_at(rate, at, pool)[2]
    elif law["kind"] == CONTACT:
        c = profile_at(x, at, pool)
        stiffness, drag = stiffness + c[1] * rate, c[0]
    elif law["kind"] == FRICTION:
        slip = math.tanh(rate / pool[at + 1])
        drag = pool[at] / pool[at + 1] * (1.0 - slip * slip)
    elif law["kind"] == LATCHED and q[law["latch"]] >= 0.0:
        drag = pool[at + 1]
    return stiffness, drag


@inner
def write_law_resistance(q: Array, u: Array, c_d: float, c_k: float, table: Table, pool: Array, work: Array) -> None:
    """Write c_d D + c_k K of the laws along the freedoms of every joint, each slope where it is not negative."""
    head = header_of(table)
    for i in range(1, head["n_bodies"]):
        for k in range(6):
            work[body_of(table, i)["work"] + W_RESIST + k] = 0.0
    for j in range(head["n_laws"]):
        law = law_of(table, j)
        stiffness, drag = law_slopes(law, q, u, pool)
        at = body_of(table, law["body"])["work"] + W_RESIST + law["freedom"]
        work[at] += c_d * max(0.0, drag) + c_k * max(0.0, stiffness)


@inner
def law_energy(q: Array, table: Table, pool: Array) -> float:
    """Energy stored in all laws."""
    total = 0.0
    for j in range(header_of(table)["n_laws"]):
        total += elastic_law(law_of(table, j), q, pool)[0]
    return total


@inner
def write_law_rows(q: Array, u: Array, rows: Array, table: Table, pool: Array) -> None:
    """Add every law's resisting force to its row (law_rows, n_u)."""
    head = header_of(table)
    for j in range(head["n_laws"]):
        law = law_of(table, j)
        rows[law["row"] * head["n_u"] + law["u"]] += law_force(law, q, u, pool)
