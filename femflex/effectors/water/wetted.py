"""Buoyancy of a round piece that the surface cuts, from its exact potential energy.

A slice across the axis at depth d, with half height c = R sqrt(1 - t_z^2), is submerged by the part F(d/c) of its area,
and the displaced volume has the energy rho g A times the integral of c G(d/c) over the length, G' = F, H' = G. Force
and torque are its derivatives, so that the righting moment of the cut is there and energy is conserved.
"""

from __future__ import annotations

import math

from femflex.kernels.compiled import inner

FLAT = 1.0  # difference of d/c over a piece below which it is summed at Gauss's points
UPRIGHT = 1e-6  # least half height over the radius
GAUSS = (-0.8611363115940526, -0.33998104358485626, 0.33998104358485626, 0.8611363115940526)
WEIGHT = (0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692)


@inner
def covered(x: float) -> tuple[float, float, float]:
    """F, G and H of a circle at depth x of its centre, in radii: submerged part of its area, and its integrals."""
    if x <= -1.0:
        return 0.0, 0.0, 0.0
    if x >= 1.0:
        return 1.0, x, 0.125 + 0.5 * x * x
    root, turned = math.sqrt(1.0 - x * x), math.acos(-x)
    F = turned + x * root
    G = x * turned + root - root * root * root / 3.0
    H = 0.5 * x * x * turned + 0.125 * math.asin(x) + x * root * (13.0 / 24.0 + x * x / 12.0) + math.pi / 16.0
    return F / math.pi, G / math.pi, H / math.pi


@inner
def wetted(depth: float, t_z: float, length: float, radius: float) -> tuple[float, float, float]:
    """Of a piece whose centre is that deep: wetted length, energy over rho g A, and its derivative by t_z.

    t_z: upward component of the tangent
    """
    half = 0.5 * length
    c = radius * math.sqrt(max(1.0 - t_z * t_z, UPRIGHT * UPRIGHT))
    deep, shallow = (depth + half * abs(t_z)) / c, (depth - half * abs(t_z)) / c
    if shallow >= 1.0:
        return length, length * depth, 0.0
    if deep <= -1.0:
        return 0.0, 0.0, 0.0
    slope = -radius * radius * t_z / c  # of c by t_z
    if deep - shallow < FLAT:
        wet = energy = turning = 0.0
        for k in range(4):
            s = half * GAUSS[k]
            x = (depth - s * t_z) / c
            F, G, _ = covered(x)
            weight = WEIGHT[k] * length
            wet += weight * F
            energy += weight * c * G
            turning += weight * (slope * (G - x * F) - s * F)
        return wet, energy, turning
    _, G2, H2 = covered(deep)
    _, G1, H1 = covered(shallow)
    per, up = c / abs(t_z), 1.0 if t_z > 0.0 else -1.0
    # along s: x = (depth - s t_z) / c; with y = |s| towards the deep end, x = (depth + y |t_z|) / c
    arm = per / abs(t_z) * (c * ((deep * G2 - H2) - (shallow * G1 - H1)) - depth * (G2 - G1))  # integral of y F
    cut = per * ((2.0 * H2 - deep * G2) - (2.0 * H1 - shallow * G1))  # integral of G - x F
    return per * (G2 - G1), c * per * (H2 - H1), slope * cut + up * arm
