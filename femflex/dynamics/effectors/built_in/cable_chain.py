"""Cables with mass: tension along the lines between neighbours of a row of points, nothing where these are near.

    N_k = max(0, S_k + c L / l_k d_k') where d_k > l_k, else 0,    S_k = EA (d_k - l_k) / l_k

d_k is the distance of neighbours, l_k the natural length between them, L the sum of these.
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.dynamics.effectors.effector_functions import ACT
from femflex.kernels.entries import entry
from femflex.kernels.vectors import add, dot, load3, scale, store3, sub

COUNT, STIFFNESS, DAMPING, TOTAL, LENGTHS = 0, 1, 2, 3, 4  # parameters


@entry(ACT)
def cable_chain(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Forces on the points. Channels: tension at the first and at the last end, slack part of the length."""
    p = parameters
    n = int(p[COUNT])
    m, slack = n + 1, 0.0
    velocities, channel = 12 * m, 6 * m
    for k in range(n):
        separation = sub(load3(seen, 3 * k + 3), load3(seen, 3 * k))
        d, length, tension = math.sqrt(dot(separation, separation)), p[LENGTHS + k], 0.0
        if d > length:
            e = scale(1.0 / d, separation)
            faster = dot(e, sub(load3(seen, velocities + 3 * k + 3), load3(seen, velocities + 3 * k)))
            elastic = p[STIFFNESS] * (d - length) / length
            tension = max(0.0, elastic + p[DAMPING] * p[TOTAL] / length * faster)
            store3(out, 3 * k, add(load3(out, 3 * k), scale(tension, e)))
            store3(out, 3 * k + 3, scale(-tension, e))
            out[channel + 3] += 0.5 * elastic * (d - length)
            out[channel + 4] += (tension - elastic) * faster
        else:
            slack += length / p[TOTAL]
        if k == 0:
            out[channel] = tension
        if k == n - 1:
            out[channel + 1] = tension
    out[channel + 2] = slack
