"""Springs between two markers: forces along the line that joins them, and their energy."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import inner
from femflex.dynamics.arithmetic.vectors import (
    UNIT,
    ZERO,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    scale,
    sub,
    turn,
    turn_back,
)
from femflex.dynamics.bodies.shapes import combined, marker_velocity
from femflex.dynamics.forces.loads import push
from femflex.dynamics.lowering.layout import W_CIN, W_OMEGA, W_POS, W_VEL, body_of, header_of
from femflex.dynamics.lowering.tie_layout import spring_of

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void

NO_LENGTH = 1e-150  # m, below which the line has no direction and the spring no force


@inner
def end_motion(
    b: Record, place: int, shape: int, bends: int, pool: Array, work: Array
) -> tuple[Vector, Vector, Vector]:
    """A marker's place from its body's origin, body components; its place and velocity, inertial components."""
    w = b["work"]
    C_iN = load9(work, w + W_CIN)
    r, v = load3(pool, place), load3(work, w + W_VEL)
    if bends:
        r = add(r, combined(pool, shape, b["wide"], work, b["delta"]))
        v = add(v, marker_velocity(pool, place, shape, bends, b, work))
    v = add(v, cross(load3(work, w + W_OMEGA), r))
    return r, add(load3(work, w + W_POS), turn_back(C_iN, r)), turn_back(C_iN, v)


@inner
def stretched(s: Record, table: Table, pool: Array, work: Array) -> tuple[Vector, Vector, Vector, float, float]:
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
def apply_spring(s: Record, table: Table, pool: Array, work: Array) -> None:
    """Put the force of a spring on its two bodies."""
    r_P, r_Q, e, length, speed = stretched(s, table, pool, work)
    data = s["data"]
    tension = pool[data] * (length - pool[data + 2]) + pool[data + 1] * speed
    P, Q = body_of(table, s["parent"]), body_of(table, s["child"])
    if s["parent"] > 0:
        force = scale(tension, turn(load9(work, P["work"] + W_CIN), e))
        push(P, force, ZERO, r_P, UNIT, s["bends_P"], s["shape_P"], s["spin_P"], pool, work)
    force = scale(-tension, turn(load9(work, Q["work"] + W_CIN), e))
    push(Q, force, ZERO, r_Q, UNIT, s["bends_Q"], s["shape_Q"], s["spin_Q"], pool, work)


@inner
def apply_springs(table: Table, pool: Array, work: Array) -> None:
    """Put the forces of all springs on their bodies."""
    for i in range(header_of(table)["n_springs"]):
        apply_spring(spring_of(table, i), table, pool, work)


@inner
def energy_of_springs(table: Table, pool: Array, work: Array) -> float:
    """Energy stored in all springs between markers."""
    total = 0.0
    for i in range(header_of(table)["n_springs"]):
        s = spring_of(table, i)
        data, length = s["data"], stretched(s, table, pool, work)[3]
        total += 0.5 * pool[data] * (length - pool[data + 2]) ** 2
    return total
