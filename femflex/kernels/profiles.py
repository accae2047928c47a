"""Profiles in the compiled model: piecewise polynomials plus sines, with two derivatives, from a flat array.

At a place in the pool stand the number of pieces, their order, the number of sines, the first and last time; then the
knots, the coefficients (pieces, order) and the sines (amplitude, omega, phase). See femflex.system.profile.
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Vector

HEAD = 5


@inner
def piece_at(t: float, knots: int, n: int, pool: Array) -> int:
    """Return the number of the piece that applies at t."""
    low, high = 0, n
    while high - low > 1:
        middle = (low + high) // 2
        if pool[knots + middle] <= t:
            low = middle
        else:
            high = middle
    return low


@inner
def profile_at(t: float, start: int, pool: Array) -> Vector:
    """s, sdot and sddot of the profile at pool[at]; NaN where it is not known."""
    if t < pool[start + 3] or t > pool[start + 4]:
        return math.nan, math.nan, math.nan
    n, order, n_sines = int(pool[start]), int(pool[start + 1]), int(pool[start + 2])
    knots = start + HEAD
    piece = piece_at(t, knots, n, pool)
    tau, c = t - pool[knots + piece], knots + n + order * piece
    s = ds = half = 0.0
    for k in range(order - 1, -1, -1):  # Horner with derivatives
        half = half * tau + ds
        ds = ds * tau + s
        s = s * tau + pool[c + k]
    dds = 2.0 * half
    for j in range(n_sines):
        wave = knots + n + order * n + 3 * j
        amplitude, omega = pool[wave], pool[wave + 1]
        sine, cosine = math.sin(omega * t + pool[wave + 2]), math.cos(omega * t + pool[wave + 2])
        s += amplitude * sine
        ds += amplitude * omega * cosine
        dds -= amplitude * omega * omega * sine
    return s, ds, dds
