"""Profiles: quantities specified in time, with their first two derivatives.

Every profile is a piecewise polynomial plus sines, so that sums stay profiles and derivatives follow by construction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from femflex.arrays import Array

STEP = (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0)  # powers of tau: from 0 to 1 with three derivatives zero at both
ENDS = ("not_a_knot", "rest")
LEAST_POINTS = {3: 4, 5: 6}  # of a spline by its degree
JUMP = 1e-9  # of s and sdot at a knot, relative to their size, still taken for rounding


@dataclass(frozen=True, eq=False)
class Profile:
    """s(t) = sum_k c[i, k] (t - knots[i])^k + sum_j amplitude_j sin(omega_j t + phase_j), t in piece i.

    knots         (n,) where pieces begin [s]; the first piece also holds before, the last one to the end
    coefficients  (n, order) powers of the time since the piece's knot, ascending
    sines         (n_s, 3) amplitude, omega [rad/s], phase [rad]
    first, last   times between which the profile is known [s]; outside it is NaN

    Raises ValueError for knots that do not ascend, numbers that are not finite, and jumps of s or of its rate.

    >>> s, rate, acceleration = Profile.smooth_step(0.0, 2.0, 0.0, 1.0)(1.0)
    >>> float(s)
    0.5
    """

    knots: Array
    coefficients: Array
    sines: Array = field(default_factory=lambda: np.zeros((0, 3)))
    first: float = -math.inf
    last: float = math.inf

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "knots", np.atleast_1d(np.asarray(self.knots, float)))
        set_(self, "coefficients", np.atleast_2d(np.asarray(self.coefficients, float)))
        set_(self, "sines", np.asarray(self.sines, float).reshape(-1, 3))
        if len(self.coefficients) != len(self.knots):
            raise ValueError(
                f"a profile has {len(self.knots)} knots and {len(self.coefficients)} pieces; as many of both"
            )
        for name in ("knots", "coefficients", "sines"):
            if not np.all(np.isfinite(getattr(self, name))):
                raise ValueError(f"{name} of a profile hold a number that is not finite")
        if np.any(np.diff(self.knots) <= 0):
            raise ValueError(f"knots of a profile must ascend: {self.knots.tolist()}")
        self._check_jumps()

    def _check_jumps(self) -> None:
        gaps = np.diff(self.knots)
        for order, name in ((0, "s"), (1, "its rate")):
            before = powers(self.coefficients[:-1], gaps, order)
            after = self.coefficients[1:, order] if self.coefficients.shape[1] > order else np.zeros(len(gaps))
            size = np.abs(self.coefficients[:-1]) @ np.ones(self.coefficients.shape[1])
            size = np.maximum(size, powers(np.abs(self.coefficients[:-1]), gaps, order))
            jumps = np.abs(after - before) > JUMP * np.maximum(size, 1e-300)
            if np.any(jumps):
                k = int(np.argmax(jumps))
                raise ValueError(
                    f"{name} of a profile jumps from {before[k]:g} to {after[k]:g} at t = {self.knots[k + 1]:g} s; "
                    "a motion needs both to go on"
                )

    def __call__(self, t: float | Array) -> tuple[Array, Array, Array]:
        """s, sdot and sddot at t (any shape), each of its shape."""
        t = np.asarray(t, float)
        piece = np.clip(np.searchsorted(self.knots, t, side="right") - 1, 0, None)
        c, tau = self.coefficients[piece], t - self.knots[piece]
        out = [powers(c, tau, order) for order in range(3)]
        for amplitude, omega, phase in self.sines:
            for order, value in enumerate(out):
                out[order] = value + amplitude * omega**order * np.sin(omega * t + phase + order * np.pi / 2)
        defined = (t >= self.first) & (t <= self.last)
        return tuple(np.where(defined, value, np.nan) for value in out)  # type: ignore[return-value]

    def __add__(self, other: Profile) -> Profile:
        """The sum of two profiles, known where both are."""
        knots = np.union1d(self.knots, other.knots)
        order = max(self.coefficients.shape[1], other.coefficients.shape[1])
        coefficients = _referred(self, knots, order) + _referred(other, knots, order)
        first, last = max(self.first, other.first), min(self.last, other.last)
        return Profile(knots, coefficients, np.concatenate([self.sines, other.sines]), first, last)

    @property
    def moves(self) -> bool:
        """Whether it is more than a constant."""
        return bool(self.coefficients[:, 1:].any() or self.sines[:, :2].all(axis=1).any())

    @property
    def breaks(self) -> Array:
        """Times at which some derivative jumps, or the profile begins or ends, ascending [s]."""
        ends = [t for t in (self.first, self.last) if math.isfinite(t)]
        return np.unique(np.concatenate([self.knots[1:], ends]))

    @property
    def numbers(self) -> Array:
        """All of it in one flat array, as the compiled equations read it (see femflex.kernels.profiles)."""
        sizes = [*self.coefficients.shape, len(self.sines), self.first, self.last]
        return np.concatenate([sizes, self.knots, self.coefficients.ravel(), self.sines.ravel()])

    @classmethod
    def constant(cls, value: float) -> Profile:
        """The profile that keeps a value."""
        return cls(np.zeros(1), np.array([[value]]))

    @classmethod
    def polynomial(cls, *coefficients: float) -> Profile:
        """c_0 + c_1 t + c_2 t^2 + ..."""
        return cls(np.zeros(1), np.array([coefficients]))

    @classmethod
    def sine(cls, amplitude: float, omega: float, phase: float = 0.0, mean: float = 0.0) -> Profile:
        """mean + amplitude sin(omega t + phase)."""
        return cls(np.zeros(1), np.array([[mean]]), np.array([[amplitude, omega, phase]]))

    @classmethod
    def smooth_step(cls, start: float, end: float, before: float, after: float) -> Profile:
        """From one value to another, at rest before `start` and after `end` [s], jerk continuous (C3)."""
        if not end > start:
            raise ValueError(f"a step from {start:g} s to {end:g} s must end after it starts")
        span, order = end - start, len(STEP)
        rise = (after - before) * np.array(STEP) / span ** np.arange(order)
        pieces = np.zeros((3, order))
        pieces[:, 0] = before, before, after
        pieces[1] += rise
        return cls(np.array([start - span, start, end]), pieces)

    @classmethod
    def trapezoid(cls, start: float, end: float, before: float, after: float, ramp: float) -> Profile:
        """From one value to another at a rate that rises, stays and falls linearly, `ramp` [s] long at either end."""
        if not 0.0 < ramp <= (end - start) / 2.0:
            raise ValueError(
                f"a trapezoid from {start:g} s to {end:g} s with ramps of {ramp:g} s: a ramp is longer than zero, and "
                "at most half of the time"
            )
        rate = (after - before) / (end - start - ramp)
        bend, rise = rate / (2.0 * ramp), rate * ramp / 2.0
        pieces = [
            [before, 0.0, 0.0],
            [before, 0.0, bend],
            [before + rise, rate, 0.0],
            [after - rise, rate, -bend],
            [after, 0.0, 0.0],
        ]
        knots = np.array([start - ramp, start, start + ramp, end - ramp, end])
        proper = np.append(np.diff(knots) > 0.0, True)
        return cls(knots[proper], np.array(pieces)[proper])

    @classmethod
    def spline(cls, times: object, values: object, degree: int = 3, ends: str = "not_a_knot") -> Profile:
        """The spline of degree 3 (C2) or 5 (C4) through values at times [s], known between the first and the last.

        ends "not_a_knot": the points alone decide; "rest": no rate (and for degree 5 no acceleration) at both ends.
        """
        times, values = np.asarray(times, float), np.asarray(values, float)
        _check_table(times, values, degree, ends)
        from scipy.interpolate import PPoly, make_interp_spline

        end_conditions = [(order, 0.0) for order in range(1, (degree + 1) // 2)]
        bounds: Any = (end_conditions, end_conditions) if ends == "rest" else None
        spline: Any = make_interp_spline(times, values, degree, bc_type=bounds)
        polynomial = PPoly.from_spline(spline)
        proper = np.diff(polynomial.x) > 0
        return cls(
            polynomial.x[:-1][proper], polynomial.c[::-1].T[proper], first=float(times[0]), last=float(times[-1])
        )


def _check_table(times: Array, values: Array, degree: int, ends: str) -> None:
    if degree not in LEAST_POINTS or ends not in ENDS:
        raise ValueError(f"a spline has degree 3 or 5 and ends {list(ENDS)}; found degree {degree} and ends {ends!r}")
    if times.ndim != 1 or times.shape != values.shape:
        raise ValueError(f"a spline needs as many values as times; found {values.size} values and {times.size} times")
    least = LEAST_POINTS[degree] if ends == "not_a_knot" else 2
    if len(times) < least:
        raise ValueError(f"a spline of degree {degree} needs at least {least} points; found {len(times)}")
    for name, numbers in (("time", times), ("value", values)):
        if not np.all(np.isfinite(numbers)):
            k = int(np.argmin(np.isfinite(numbers)))
            raise ValueError(f"{name} {k + 1} of a spline is {numbers[k]}; all must be finite numbers")
    falls = np.flatnonzero(np.diff(times) <= 0)
    if len(falls):
        k = int(falls[0])
        raise ValueError(f"time {times[k + 1]:g} s of a spline follows {times[k]:g} s; times must ascend")


def powers(c: Array, tau: Array, order: int) -> Array:
    """Derivative of that order of sum_k c[..., k] tau^k."""
    value = np.zeros(np.broadcast_shapes(c.shape[:-1], tau.shape))
    for k in range(c.shape[-1] - 1, order - 1, -1):
        value = value * tau + math.perm(k, order) * c[..., k]
    return value


def _referred(profile: Profile, knots: Array, order: int) -> Array:
    """The profile's pieces over finer knots (n,), (n, order)."""
    piece = np.clip(np.searchsorted(profile.knots, knots, side="right") - 1, 0, None)
    c, shift = profile.coefficients[piece], knots - profile.knots[piece]
    out = np.zeros((len(knots), order))
    for k in range(c.shape[1]):
        out[:, k] = powers(c, shift, k) / math.factorial(k)
    return out
