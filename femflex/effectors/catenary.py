"""Elastic cables that hang at rest between two ends, with a part of them on a flat floor where the lower end lies.

From the lower end, with horizontal tension H, vertical tension V at the upper end, weight w per length and length L
(Irvine, Cable Structures, 1981; Jonkman, NREL/TP-500-41958, 2007), the part s of the length is at

    x = H/w [asinh((V_0 + w s)/H) - asinh(V_0/H)] + H s/EA,    V_0 = V - w L
    z = H/w [sqrt(1 + ((V_0 + w s)/H)^2) - sqrt(1 + (V_0/H)^2)] + (V_0 s + w s^2/2)/EA

and with V < w L on a floor without friction the first L - V/w lies straight.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import root

from femflex.arrays import Array

LIGHT = 1e-9  # of EA: weight of a cable that counts as none
STEEP = 1e-6  # horizontal distance over the length below which a cable hangs plumb


def hanging_places(
    span: ArrayLike, length: float, EA: float, weight: float, up: ArrayLike, shares: ArrayLike, floor: bool = False
) -> Array:
    """Places (k, 3) [m] of parts of a hanging cable, from its first end.

    span    (3,) from its first end to the other [m];  length  without stretch [m]
    weight  per length, negative where it floats [N/m];  up  (3,) unit vector
    shares  (k,) of the length, from the first end;  floor  whether the lower end lies on a floor
    Raises ValueError where no such cable is found.
    """
    span, up, s = np.asarray(span, float), np.asarray(up, float), np.asarray(shares, float)
    if abs(weight) * length < LIGHT * EA:
        return np.outer(s, span)
    if weight < 0.0:
        up, weight, floor = -up, -weight, False
    rise = float(span @ up)
    if rise < 0.0:  # from the other end, which is the lower one
        return span + hanging_places(-span, length, EA, weight, up, 1.0 - s, floor)
    along = span - rise * up
    reach = float(np.linalg.norm(along))
    if reach < STEEP * length:
        raise ValueError("a cable that hangs from ends above one another has no one shape; start it straight")
    H, V = _tensions(reach, rise, length, EA, weight, floor)
    x, z = _profile(s * length, H, V, length, EA, weight, floor)
    return np.outer(x / reach, along) + np.outer(z, up)


def _profile(s: Array, H: float, V: float, length: float, EA: float, weight: float, floor: bool) -> tuple[Array, Array]:
    lying = max(0.0, length - V / weight) if floor else 0.0
    free, V_0 = np.maximum(s - lying, 0.0), max(V - weight * length, 0.0) if floor else V - weight * length
    V_s = V_0 + weight * free
    x = np.minimum(s, lying) + H / weight * (np.arcsinh(V_s / H) - np.arcsinh(V_0 / H)) + H * s / EA
    z = H / weight * (np.hypot(1.0, V_s / H) - np.hypot(1.0, V_0 / H)) + (V_0 * free + weight * free**2 / 2) / EA
    return x, z


def _tensions(reach: float, rise: float, length: float, EA: float, weight: float, floor: bool) -> tuple[float, float]:
    """H and V at the upper end."""
    chord = np.hypot(reach, rise)
    slack = 3.0 * ((length**2 - rise**2) / reach**2 - 1.0)
    bent = np.sqrt(slack) if slack > 0.0 else 0.2
    H = weight * reach / (2.0 * bent) + max(0.0, EA * (chord / length - 1.0))
    V = weight / 2.0 * (rise / np.tanh(bent) + length)

    def gap(unknown: Array) -> Array:
        x, z = _profile(np.array([length]), np.exp(unknown[0]), unknown[1] * weight * length, length, EA, weight, floor)
        return np.array([x[0] - reach, z[0] - rise]) / length

    found = root(gap, [np.log(H), V / (weight * length)], tol=1e-13)
    if not np.abs(gap(found.x)).max() < 1e-9:
        raise ValueError(
            f"no hanging cable of {length:.4g} m was found between ends {chord:.4g} m apart; start it straight"
        )
    return float(np.exp(found.x[0])), float(found.x[1] * weight * length)
