"""Coordinates of joints and shapes: their rates from quasi-velocities, and where a finite motion takes them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.compiled import inner
from femflex.dynamics.layout import BALL_ANGLES, BALL_QUATERNION
from femflex.dynamics.turns import (
    angle_rates,
    angles_of,
    angles_turn,
    quaternion_advanced,
    quaternion_rates,
    vector_turn,
)
from femflex.dynamics.vectors import Vector, dot, load3, load4, product, store3, store4, sub

Array = NDArray[np.float64]
Record = np.void


@inner
def coordinate_rates(b: Record, q: Array, u: Array, dq: Array, pool: Array) -> None:
    """qdot = N(q) u of one body's joint and elastic coordinates."""
    for k in range(b["n_slide"] + b["n_turn"]):
        dq[b["q"] + k] = u[b["u"] + k]
    j, v = b["q"] + b["n_slide"], b["u"] + b["n_slide"]
    if b["ball"] == BALL_QUATERNION:
        store4(dq, j, quaternion_rates(load4(q, j), load3(u, v)))
    elif b["ball"] == BALL_ANGLES:
        store3(dq, j, angle_rates(load3(q, j), load3(pool, b["axes"] + 3 * b["n_slide"]), load3(u, v)))
    for k in range(b["n"]):
        dq[b["qe"] + k] = u[b["ue"] + k]


@inner
def beside(angles: Vector, old: Vector) -> Vector:
    """Angles shifted by whole turns to lie next to the old ones."""
    whole = 2.0 * math.pi
    return (
        angles[0] + whole * math.floor((old[0] - angles[0]) / whole + 0.5),
        angles[1] + whole * math.floor((old[1] - angles[1]) / whole + 0.5),
        angles[2] + whole * math.floor((old[2] - angles[2]) / whole + 0.5),
    )


@inner
def nearest_angles(angles: Vector, old: Vector, numbers: Vector) -> Vector:
    """Of the two sets of angles of one turn, each up to whole turns, the one next to the old angles."""
    first = beside(angles, old)
    mirror = -angles[1] if numbers[2] == numbers[0] else math.pi - angles[1]
    second = beside((angles[0] + math.pi, mirror, angles[2] + math.pi), old)
    to_first, to_second = sub(first, old), sub(second, old)
    return first if dot(to_first, to_first) <= dot(to_second, to_second) else second


@inner
def advance_coordinates(b: Record, q: Array, step: Array, out: Array, pool: Array) -> None:
    """One body's joint and elastic coordinates after unit time at the constant quasi-velocity `step`."""
    for k in range(b["n_slide"] + b["n_turn"]):
        out[b["q"] + k] = q[b["q"] + k] + step[b["u"] + k]
    j, v = b["q"] + b["n_slide"], b["u"] + b["n_slide"]
    if b["ball"] == BALL_QUATERNION:
        store4(out, j, quaternion_advanced(load4(q, j), load3(step, v)))
    elif b["ball"] == BALL_ANGLES:
        numbers = load3(pool, b["axes"] + 3 * b["n_slide"])
        turned = product(angles_turn(load3(q, j), numbers), vector_turn(load3(step, v)))
        store3(out, j, nearest_angles(angles_of(turned, numbers), load3(q, j), numbers))
    for k in range(b["n"]):
        out[b["qe"] + k] = q[b["qe"] + k] + step[b["ue"] + k]
