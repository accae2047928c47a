"""Observed order of convergence over refined meshes, and Richardson's extrapolation.

v(h) = v_0 + c h^p through three successive values; L. F. Richardson, The deferred approach to the limit, Phil. Trans.
A 226 (1927) 299; P. J. Roache, J. Fluids Eng. 116 (1994) 405 for the observed order. Here x = 1 / h.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from femflex.arrays import Array
from femflex.studies.law import Law, State, Trend

HIGHEST = 60.0  # an observed order beyond this is not looked for
LOWEST = 0.3  # an observed order below this is no convergence
FAINT = 1e-6  # relative change below which a change that does not decrease counts as rounding
SURELY = 3.0  # changes up to this multiple of the estimated rounding error count as rounding


def observed_order(x: ArrayLike, values: ArrayLike) -> float:
    """Order p [1] of v_0 + c x^-p through values (3,), in any unit, at ascending x (3,), from (v1 - v0) / (v2 - v1).

    log((v1 - v0) / (v2 - v1)) / log 2 when x doubles. nan when the changes differ in sign; 0 when they do not fall.
    """
    (x0, x1, x2), (v0, v1, v2) = np.asarray(x, float), np.asarray(values, float)
    if not (v1 - v0) * (v2 - v1) > 0:
        return math.nan
    a, b, ratio = math.log(x1 / x0), math.log(x2 / x1), math.log((v1 - v0) / (v2 - v1))
    if math.isclose(a, b, rel_tol=1e-9):
        return max(ratio / a, 0.0)
    if ratio <= math.log(a / b):
        return 0.0
    return float(brentq(lambda p: math.log(math.expm1(p * a) / -math.expm1(-p * b)) - ratio, 1e-9, HIGHEST / min(a, b)))


def extrapolated(x: ArrayLike, values: ArrayLike, order: float) -> float:
    """The limit v_0, in the unit of the values, of v_0 + c x^-order through values (2,) at ascending x (2,)."""
    (x0, x1), (v0, v1) = np.asarray(x, float), np.asarray(values, float)
    return float(v1 + (v1 - v0) / math.expm1(order * math.log(x1 / x0)))


def mesh_trend(x: ArrayLike, values: ArrayLike, noise: ArrayLike = 0.0) -> Trend:
    """The trend of values (n,), in any unit, at ascending cells per length x (n,); noise (n,): rounding, if known."""
    x, v = np.asarray(x, float), np.asarray(values, float)
    noise = np.broadcast_to(np.asarray(noise, float), v.shape)
    if len(v) < 2:
        return Trend("one", float(v[-1]), math.nan)
    last_resolved, change = _last_above_rounding(v, noise), np.abs(np.diff(v))
    if len(v) == 2 and last_resolved == 1:
        return Trend("few", float(v[1]), float(change[0]))
    rounded = last_resolved + 1 if last_resolved + 1 < len(v) else None
    floor = float(max(noise[last_resolved], change[last_resolved])) if rounded is not None else 0.0
    if last_resolved < 2:
        return Trend("rounded" if last_resolved else "constant", float(v[last_resolved]), floor, rounded=rounded)
    orders = [observed_order(x[k : k + 3], v[k : k + 3]) for k in range(last_resolved - 1)]
    if orders[-1] < LOWEST:
        return Trend("unsettled", math.nan, math.nan, rounded=rounded)
    contradicting = [
        p for p in orders[-2:] if not p >= LOWEST
    ]  # an order seen once, and contradicted by another value, is chance
    if contradicting:
        state: State = "swinging" if math.isnan(contradicting[0]) else "settling"
        return Trend(
            state,
            float(v[last_resolved]),
            max(float(change[last_resolved - 2 : last_resolved].max()), floor),
            rounded=rounded,
        )
    return _extrapolated_trend(x[: last_resolved + 1], v[: last_resolved + 1], orders, floor, rounded)


def _extrapolated_trend(x: Array, v: Array, orders: list[float], floor: float, rounded: int | None) -> Trend:
    """Richardson's limit, with the difference from that of the triple before as its uncertainty."""
    limit = extrapolated(x[-2:], v[-2:], orders[-1])
    spread, earlier_orders = abs(limit - float(v[-1])), [p for p in orders[-3:-1] if p >= LOWEST]
    if len(orders) > 1:
        spread = abs(limit - extrapolated(x[-3:-1], v[-3:-1], orders[-2]))
    scatter = max((abs(p - orders[-1]) for p in earlier_orders), default=math.nan)
    law = Law("algebraic", orders[-1], abs(limit - float(v[-1])), float(x[-1]))
    return Trend("law", limit, max(spread, floor), law, scatter, rounded)


def _last_above_rounding(v: Array, noise: Array) -> int:
    """The last level that differs from the one before by more than rounding; 0 when none does."""
    change, scale = np.abs(np.diff(v)), float(np.abs(v).max())
    resolved = np.flatnonzero(change > SURELY * (noise[:-1] + noise[1:]))
    last_resolved = int(resolved[-1]) + 1 if resolved.size else 0
    for k in range(1, last_resolved):
        faint = max(change[k], change[k - 1]) < FAINT * scale
        if faint and (change[k] > 0.7 * change[k - 1] or np.diff(v)[k] * np.diff(v)[k - 1] <= 0):
            return k if k > 1 else 0  # the first change has none before it to fall from
    return last_resolved
