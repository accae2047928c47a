"""Decrease of the error of a truncated set of modes, fitted over all numbers of modes.

E_k = |v_k - v_K| = c (g(n_k) - g(n_K)) with g = n^-p or exp(-p n), in logarithms, so that every count has the same
weight. Truncation errors decrease in steps, because some modes take no part, so three values are not enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from femflex.arrays import Array, IntArray
from femflex.studies.law import Kind, Law, State, Trend, shape

KINDS: tuple[Kind, ...] = ("algebraic", "geometric")
FITTED = 6  # number of the last counts above rounding that are fitted; coarser ones follow no law yet
CLEAR = 1.0  # misfit (root mean square, of the logarithm) above which the errors follow no law: a factor of e
FALLEN = 1.0  # logarithm of the decrease over the fitted counts below which there is no convergence
SURELY = 3.0  # differences up to this multiple of the estimated rounding error count as rounding


def mode_trend(counts: ArrayLike, values: ArrayLike, noise: ArrayLike = 0.0) -> Trend:
    """The trend of values (n,), in any unit, at ascending counts (n,); noise (n,) is their rounding error, if known."""
    n, v = np.asarray(counts, float), np.asarray(values, float)
    noise = np.broadcast_to(np.asarray(noise, float), v.shape)
    if len(v) < 2:
        return Trend("one", float(v[-1]), math.nan)
    off = v[:-1] - v[-1]
    resolved = np.flatnonzero(np.abs(off) > SURELY * (noise[:-1] + noise[-1]))
    floor = float(noise.max())
    if not resolved.size:
        return Trend("constant", float(v[-1]), max(floor, float(np.abs(off).max())))
    if len(v) < 3:
        return Trend("few", float(v[-1]), abs(float(off[0])))
    resolved = resolved[-FITTED:]
    signs = np.unique(np.sign(off[resolved]))
    fit = _best_fit(n, np.abs(off), resolved) if resolved.size > 1 else None
    if fit is None or signs.size > 1 or fit.misfit > CLEAR:  # not when the misfit is nan
        return _trend_without_law(v, "swinging" if signs.size > 1 else "settling", floor)
    law = fit.law
    if float(np.log(law.error(n[resolved[0]]) / law.size)) < FALLEN:
        return Trend("unsettled", math.nan, math.nan)
    limit = float(v[-1] - math.copysign(law.size, off[resolved[-1]]))
    return Trend("law", limit, max(fit.doubt, floor), law, fit.misfit)


def _trend_without_law(v: Array, state: State, floor: float) -> Trend:
    """The last value as the limit, uncertain by the last two changes; no limit unless these are the small ones."""
    change = np.abs(np.diff(v))
    recent = float(change[-2:].max())
    if len(change) < 3 or recent > 0.5 * change[:-2].max():
        return Trend("unsettled", math.nan, math.nan)
    return Trend(state, float(v[-1]), max(recent, floor))


@dataclass(frozen=True)
class Fit:
    """A fitted law, its misfit (nan with only two differences), and the uncertainty of the remaining error."""

    law: Law
    misfit: float
    doubt: float


def _best_fit(n: Array, error: Array, resolved: IntArray) -> Fit:
    """The law that fits clearly better, or else that of the larger error; if both fit, both enter the uncertainty."""
    fits = [_fit(kind, n[resolved], float(n[-1]), error[resolved]) for kind in KINDS]
    cautious = max(fits, key=lambda fit: fit.law.size)
    if resolved.size == 2:
        return Fit(cautious.law, math.nan, cautious.law.size)
    better, worse = sorted(fits, key=lambda fit: fit.misfit)
    selected = better if better.misfit < 0.5 * worse.misfit else cautious
    if worse.misfit > 10.0 * better.misfit:
        return selected
    return replace(selected, doubt=max(selected.doubt, abs(better.law.size - worse.law.size)))


def _fit(kind: Kind, n: Array, largest_n: float, error: Array) -> Fit:
    """Least squares of log E - log c (g(n) - g(last)), with the root mean square misfit."""

    def residual(log_rate: Array) -> Array:
        log_ratio = np.log(error) - np.log(shape(kind, float(np.exp(log_rate[0])), n, largest_n) - 1.0)
        return np.asarray(log_ratio - log_ratio.mean())

    span = math.log(largest_n / n[0]) if kind == "algebraic" else largest_n - n[0]
    starts = np.log(np.geomspace(1e-3, 300.0, 60) / span)
    start = min(starts, key=lambda s: float(np.sum(residual(np.array([s])) ** 2)))
    bounds = (starts[0] - 1.0, starts[-1] + 0.5)
    solution = least_squares(residual, [start], bounds=bounds, x_scale=0.1, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    rate = float(np.exp(solution.x[0]))
    size = float(np.exp(np.mean(np.log(error) - np.log(shape(kind, rate, n, largest_n) - 1.0))))
    misfit = float(np.sqrt(np.mean(solution.fun**2)))
    return Fit(Law(kind, rate, size, largest_n), misfit, size * math.expm1(min(misfit, 50.0)))
