"""Cables: tension along the line between two markers while their distance exceeds the length, and nothing below it.

    N = max(0, S + c (d' - L')) where d > L, else 0,    S = EA (d - L) / L

d is the distance, L(t) the length that is let out. Stored energy EA (d - L)^2 / (2 L). What its drum supplies is
-(N + S^2 / (2 EA)) L': the second part is the strain of the length that comes to it.
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.dynamics.effectors.effector_functions import ACT
from femflex.kernels.entries import entry
from femflex.kernels.profiles import profile_at
from femflex.kernels.vectors import dot, load3, scale, store3, sub

STIFFNESS, DAMPING, PROFILE = 0, 1, 2  # parameters
VELOCITY, CHANNEL = 24, 12  # of two markers
ENERGY, DISSIPATION, SUPPLIED = 15, 16, 17


@entry(ACT)
def cable(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Forces on two markers. Channels: tension, distance, length."""
    separation = sub(load3(seen, 3), load3(seen, 0))
    d = math.sqrt(dot(separation, separation))
    length, rate, _ = profile_at(t, PROFILE, parameters)
    tension = 0.0 if length > 0.0 else math.nan
    out[0] = tension  # which ends the run
    if d > length > 0.0:
        e = scale(1.0 / d, separation)
        faster = dot(e, sub(load3(seen, VELOCITY + 3), load3(seen, VELOCITY))) - rate
        elastic = parameters[STIFFNESS] * (d - length) / length
        tension = max(0.0, elastic + parameters[DAMPING] * faster)
        store3(out, 0, scale(tension, e))
        store3(out, 3, scale(-tension, e))
        out[ENERGY] = 0.5 * elastic * (d - length)
        out[DISSIPATION] = (tension - elastic) * faster
        out[SUPPLIED] = -(tension + 0.5 * elastic * elastic / parameters[STIFFNESS]) * rate
    out[CHANNEL], out[CHANNEL + 1], out[CHANNEL + 2] = tension, d, length
