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
from femflex.dynamics.vectors import load3, load4, product, store3, store4

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
        angles = angles_of(turned, numbers)
        for k in range(3):  # shifted by whole turns to lie next to the old ones
            turns = math.floor((q[j + k] - angles[k]) / (2.0 * math.pi) + 0.5)
            out[j + k] = angles[k] + 2.0 * math.pi * turns
    for k in range(b["n"]):
        out[b["qe"] + k] = q[b["qe"] + k] + step[b["ue"] + k]
