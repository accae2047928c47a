"""Separation springs: two markers pushed apart along the line between them, until the spring is at its free length."""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.dynamics.effectors.effector_functions import ACT
from femflex.kernels.entries import entry
from femflex.kernels.vectors import dot, load3, scale, store3, sub

STIFFNESS, LENGTH = 0, 1  # parameters


@entry(ACT)
def separation(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Force k (l - d) on both markers while their distance d is below the free length l. Channel: distance."""
    vector = sub(load3(seen, 3), load3(seen, 0))
    d = math.sqrt(dot(vector, vector))
    compression = max(0.0, parameters[LENGTH] - d)
    push = scale(parameters[STIFFNESS] * compression / d if d > 0.0 else 0.0, vector)
    store3(out, 0, scale(-1.0, push))
    store3(out, 3, push)
    out[12] = d
    out[13] = 0.5 * parameters[STIFFNESS] * compression * compression
