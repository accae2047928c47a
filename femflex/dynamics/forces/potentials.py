"""Attraction and potential per mass at a place: beyond the gradient form, of zonal harmonics, and of a third body.

With Battin's function f(q) = (1 + q)^(3/2) - 1 = q (3 + 3 q + q^2) / (1 + (1 + q)^(3/2)) differences of attraction have
no cancellation (Battin 1987, section 8.7).
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import root
from femflex.kernels.vectors import Vector, add, dot, scale


@formula
def battin(q: float) -> float:
    """(1 + q)^(3/2) - 1."""
    return q * (3.0 + q * (3.0 + q)) / (1.0 + (1.0 + q) * root(1.0 + q))


@inner
def beyond_gradient(mu: float, a0: float, l: Vector, d: Vector) -> tuple[Vector, float]:
    """Attraction beyond its gradient at d from the point of expansion a0 l, and its potential, per mass.

    With e = d/a0, q = 2 l.e + e.e and s = (1 + q)^(-3/2):  a = -(mu/a0^2) [l (s - 1 + 3 l.e) + e (s - 1)]
    """
    e = scale(1.0 / a0, d)
    le, ee = dot(l, e), dot(e, e)
    q = 2.0 * le + ee
    w = math.sqrt(1.0 + q)
    f = battin(q)
    s = -f / (1.0 + f)
    a = scale(-mu / (a0 * a0), add(scale(s + 3.0 * le, l), scale(s, e)))
    return a, mu / a0 * (q / (w * (1.0 + w)) - le - 0.5 * ee + 1.5 * le * le)


@inner
def zonal(mu: float, strengths: Array, highest: int, r: Vector) -> tuple[Vector, float]:
    """Attraction of the zonal harmonics at r from the centre, inertial components, and its potential, per mass.

    U = mu sum_n J_n R_e^n P_n(s) / r^(n+1)        a = -grad U = mu sum_n J_n R_e^n (P'_(n+1) r/|r| - P'_n k) / r^(n+2)

    with s = k.r/|r| and P'_(n+1) = s P'_n + (n + 1) P_n; the pole k is the inertial Z axis. strengths: J_n R_e^n from
    n = 2 on.
    """
    inverse = 1.0 / math.sqrt(dot(r, r))
    s, share = r[2] * inverse, mu * inverse  # share: mu/r^n
    before, P, slope = 1.0, s, 3.0 * s  # P_(n-2), P_(n-1), P'_n
    outward = along = U = 0.0
    for n in range(2, highest + 1):
        before, P = P, before + (2.0 - 1.0 / n) * (s * P - before)
        steeper = s * slope + (n + 1) * P
        share *= inverse
        weight = share * strengths[n - 2] * inverse
        U += weight * P
        outward += weight * steeper
        along -= weight * slope
        slope = steeper
    return add(scale(outward * inverse * inverse, r), (0.0, 0.0, along * inverse)), U


@inner
def tide(mu: float, s: Vector, r: Vector) -> tuple[Vector, float]:
    """Attraction of a third body at s less that at the centre, at r from there, and its potential, per mass.

    a = mu [(s - r)/|s - r|^3 - s/|s|^3] = -mu/|s - r|^3 (r + f(q) s)        q = r.(r - 2 s)/s^2
    U = -mu [1/|s - r| - 1/|s| - s.r/|s|^3]
    """
    s2, rr = dot(s, s), dot(r, r)
    s1 = math.sqrt(s2)
    q = (rr - 2.0 * dot(s, r)) / s2
    w = math.sqrt(1.0 + q)
    a = scale(-mu / (s2 * s1 * (1.0 + q) * w), add(r, scale(battin(q), s)))
    return a, -mu / s1 * (q * q * (2.0 + w) / (2.0 * w * (1.0 + w) ** 2) - 0.5 * rr / s2)
