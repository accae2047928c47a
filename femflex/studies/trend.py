"""Trends of a sequence of values towards a limit, and the laws by which their errors decrease.

Over refined meshes v(h) = v_0 + c h^p through three successive values, here with x = 1 / h; L. F. Richardson, The
deferred approach to the limit, Phil. Trans. A 226 (1927) 299; P. J. Roache, J. Fluids Eng. 116 (1994) 405 for the
observed order. Over numbers of modes E_k = |v_k - v_K| = c (g(n_k) - g(n_K)) with g = n^-p or exp(-p n), in logarithms,
so that every count has the same weight: truncation errors decrease in steps, because some modes take no part, so that
three values are not enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, least_squares

from femflex.arrays import Array, IntArray

Kind = Literal["algebraic", "geometric"]
State = Literal["one", "few", "constant", "law", "rounded", "settling", "swinging", "unsettled"]
KINDS: tuple[Kind, ...] = ("algebraic", "geometric")
HIGHEST = 60.0  # an observed order beyond this is not looked for
LOWEST = 0.3  # an observed order below this is no convergence
FAINT = 1e-6  # relative change below which a change that does not decrease counts as rounding
SURELY = 3.0  # changes up to this multiple of the estimated rounding error count as rounding
FITTED = 6  # number of the last counts above rounding that are fitted; coarser ones follow no law yet
CLEAR = 1.0  # misfit (root mean square, of the logarithm) above which the errors follow no law: a factor of e
FALLEN = 1.0  # logarithm of the decrease over the fitted counts below which there is no convergence


@dataclass(frozen=True)
class Law:
    """An error that falls like (x / reference)^-rate or exp(-rate (x - reference)), `size` at the reference."""

    kind: Kind
    rate: float
    size: float
    reference: float

    def error(self, x: ArrayLike) -> Array:
        """The error at x (...,), in the unit of the quantity."""
        return np.asarray(self.size * shape(self.kind, self.rate, np.asarray(x, float), self.reference))

    def reaches(self, error: float) -> float:
        """The x at which the error has fallen to this."""
        decay = math.log(self.size / error) if self.size > 0 else -math.inf
        if self.kind == "algebraic":
            return float(self.reference * np.exp(min(decay / self.rate, 700.0)))
        return self.reference + decay / self.rate


def shape(kind: Kind, rate: float, x: Array, reference: float) -> Array:
    """The law's error at x over that at the reference (...,) [1]."""
    if kind == "algebraic":
        return np.asarray((x / reference) ** -rate)
    return np.asarray(np.exp(-rate * (x - reference)))


@dataclass(frozen=True, eq=False)
class Trend:
    """Trend of successive values towards their limit.

    state    one, few       too few values to judge
             constant       no change above rounding
             law            errors fall by `law`; the limit is extrapolated
             settling       the last changes are small compared with the earlier ones, but follow no law
             swinging       the last changes have both signs
             unsettled      the changes do not fall; there is no limit (nan)
    limit    best estimate of the limit, spread its own uncertainty
    scatter  deviation from the law: of the observed order, or of the logarithm of the errors in a fit; nan if the law
             has as many parameters as there are values
    rounded  first level whose value differs from the one before only by rounding, or None
    """

    state: State
    limit: float
    spread: float
    law: Law | None = None
    scatter: float = math.nan
    rounded: int | None = None

    @property
    def order(self) -> float:
        """Rate of the law, nan without one."""
        return math.nan if self.law is None else self.law.rate


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
