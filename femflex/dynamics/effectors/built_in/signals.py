"""Signals: numbers given as tables over time."""

from __future__ import annotations

from femflex.arrays import Array
from femflex.dynamics.effectors.effector_functions import ACT
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry

# parameters, as femflex.system.signal lays them
KIND, COUNT, TABLE = 0, 1, 2
STEPS, LINEAR, SMOOTH = 0.0, 1.0, 2.0


@inner
def step_of(t: float, p: Array, first: int, n: int) -> int:
    """Number of the last of n rising times p[first + k] that is not after t, -1 before the first."""
    low, high = -1, n
    while high - low > 1:
        middle = (low + high) // 2
        if p[first + middle] <= t:
            low = middle
        else:
            high = middle
    return low


@entry(ACT)
def signal(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Channels: value, rate. Before the first time and after the last the value stays.

    Smooth pieces are s^3 (10 - 15 s + 6 s^2): rate and acceleration vanish at both ends.
    """
    p = parameters
    n = int(p[COUNT])
    k = step_of(t, p, TABLE, n)
    value, rate = p[TABLE + n + max(k, 0)], 0.0
    if 0 <= k < n - 1 and p[KIND] != STEPS:
        span, rise = p[TABLE + k + 1] - p[TABLE + k], p[TABLE + n + k + 1] - p[TABLE + n + k]
        s = (t - p[TABLE + k]) / span
        if p[KIND] == LINEAR:
            value, rate = value + rise * s, rise / span
        else:
            value += rise * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
            rate = rise / span * 30.0 * s * s * (1.0 - s) * (1.0 - s)
    out[0], out[1] = value, rate
