"""Start of an adaptive method: its automatic first step, and the call for a change of coordinates between steps."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.integrate.compiled import kernel
from femflex.integrate.protocol import SWITCH, Call, Model


def set_rate(model: Model, t: float, x: Array, out: Array, span: tuple[float, float, float]) -> None:
    """Set out = f(t, x), with t limited to the smooth interval."""
    inside = min(max(float(t), span[1]), span[2])
    model.rate(inside, np.ascontiguousarray(x), out, model.table, model.pool, model.work)


def first_step(
    model: Model, order: int, t: float, span: tuple[float, float, float], x: Array, k1: Array, rtol: float, atol: Array
) -> float:
    """First step size [s] by Hairer, Norsett & Wanner (1993), II.4; sets k1 = f(t, x) and asks the rate twice."""
    with np.errstate(all="ignore"):
        set_rate(model, t, x, k1, span)
        scale = atol + rtol * np.abs(x)
        counted = scale < np.inf
        d0, d1 = norm(x[counted] / scale[counted]), norm(k1[counted] / scale[counted])
        h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
        h0 = min(h0, span[0] - t)
        k2 = np.empty_like(k1)
        set_rate(model, t + h0, x + h0 * k1, k2, span)
        d2 = norm((k2 - k1)[counted] / scale[counted]) / h0 if h0 > 0.0 else 0.0
        steepest = max(d1, d2)
        h1 = max(1e-6, h0 * 1e-3) if steepest <= 1e-15 else (0.01 / steepest) ** (1 / order)
        h = min(100 * h0, h1)
    return float(h) if np.isfinite(h) and h > 0.0 else 1e-6  # rates that are not finite are met by the first trial


def norm(v: Array) -> float:
    """Root mean square of v."""
    return float(np.sqrt(np.mean(v**2))) if v.size else 0.0


@kernel(SWITCH)
def no_switch(t: float, x: Array, table: IntArray, pool: Array, work: Array) -> int:
    """Number 0 of changes."""
    return 0


def switch_of(model: Model) -> Call:
    """The model's call for a change of coordinates, or `no_switch`."""
    return no_switch if model.switch is None else model.switch
