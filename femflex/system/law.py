"""Laws of joint freedoms beyond linear springs and dampers: tables, stops, friction, and latches.

Each acts on one slide or turn of a joint. A law's force counts as it resists: against a positive stretch or rate it is
positive, and the joint feels minus it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femflex.system.profile import STEP, Profile, powers

Array = NDArray[np.float64]

SPRING, DAMPER, CONTACT, FRICTION, LATCHED = 0, 1, 2, 3, 4  # how a piece of a law is evaluated (femflex.dynamics.laws)
Piece = tuple[int, Array]  # one of these, and its numbers


@dataclass(frozen=True, eq=False)
class Law:
    """A law of freedom number `freedom` of a joint, translations first."""

    freedom: int = 0
    name: str = ""

    kind: ClassVar[str] = "law"

    def force(self, q: Array, u: Array) -> Array:
        """Resisting force or torque at coordinates q and rates u (any equal shape)."""
        raise NotImplementedError

    def energy(self, q: Array) -> Array:
        """Energy stored at coordinates q [J]."""
        return np.zeros_like(q)

    def power(self, q: Array, u: Array) -> Array:
        """Power taken out of the motion for good [W]."""
        return self.force(q, u) * u

    @property
    def stiffest(self) -> float:
        """Largest stiffness it can have."""
        return 0.0

    def pieces(self) -> list[Piece]:
        """What the compiled equations evaluate, summed."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class _Elastic(Law):
    """A law with a potential V(q), a piecewise polynomial."""

    @property
    def potential(self) -> Profile:
        """V, V' and V'' of the coordinate."""
        raise NotImplementedError

    def force(self, q: Array, u: Array) -> Array:
        return self.potential(q)[1]

    def energy(self, q: Array) -> Array:
        return self.potential(q)[0]

    def power(self, q: Array, u: Array) -> Array:
        return np.zeros_like(q)

    @property
    def stiffest(self) -> float:
        knots = self.potential.knots
        return float(np.max(self.potential(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))[2]))

    def pieces(self) -> list[Piece]:
        return [(SPRING, self.potential.numbers)]


@dataclass(frozen=True, eq=False)
class TabulatedSpring(_Elastic):
    """Resisting force through a table over the coordinate, monotone between monotone points, linear beyond them.

    stretch (n,) ascending [m, rad];  resisting (n,) [N, N m]. The force is C1 (piecewise cubic).
    """

    stretch: ArrayLike = ()
    resisting: ArrayLike = ()

    kind: ClassVar[str] = "spring"

    @cached_property
    def potential(self) -> Profile:
        return _integral(self.stretch, self.resisting, "spring")


@dataclass(frozen=True, eq=False)
class TabulatedDamper(Law):
    """Resisting force through a table over the rate, monotone between monotone points, linear beyond them.

    rate (n,) ascending [m/s, rad/s];  resisting (n,) [N, N m]; it must not push: force times rate is not negative.
    """

    rate: ArrayLike = ()
    resisting: ArrayLike = ()

    kind: ClassVar[str] = "damper"

    def __post_init__(self) -> None:
        rate, force = np.asarray(self.rate, float), np.asarray(self.resisting, float)
        _ = self.dissipation
        if np.any(rate * force < 0):
            k = int(np.argmax(rate * force < 0))
            raise ValueError(f"a damper with force {force[k]:g} at rate {rate[k]:g} drives the joint; it must resist")

    @cached_property
    def dissipation(self) -> Profile:
        """Rayleigh's R(u) with R' the force."""
        return _integral(self.rate, self.resisting, "damper")

    def force(self, q: Array, u: Array) -> Array:
        return self.dissipation(u)[1]

    def pieces(self) -> list[Piece]:
        return [(DAMPER, self.dissipation.numbers)]


@dataclass(frozen=True, eq=False)
class Stop(_Elastic):
    """Stops at a lower and an upper limit, or one of them: a stiffness and damping that set in beyond it.

    Both rise from nothing over `width` beyond the limit as a smooth step (C3), so the elastic force is C4 in the
    coordinate and an integrator of order 8 follows it with steps of about the time that the width takes.
    """

    lower: float | None = None
    upper: float | None = None
    stiffness: float = 0.0
    damping: float = 0.0
    width: float = 0.01

    kind: ClassVar[str] = "stop"

    def __post_init__(self) -> None:
        if self.lower is None and self.upper is None:
            raise ValueError("a stop needs a lower or an upper limit, or both")
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise ValueError(f"the lower limit {self.lower:g} of a stop is not below its upper limit {self.upper:g}")
        if not self.stiffness > 0 or self.damping < 0 or not self.width > 0:
            raise ValueError(
                f"a stop has stiffness {self.stiffness:g}, damping {self.damping:g} and width {self.width:g}; "
                "stiffness and width must be positive, damping not negative"
            )

    def _beyond(self, middle: Array, far: Array) -> Profile:
        """0 inside; at a depth d beyond a limit `middle` in powers of d, past the width `far` in those of d - w."""
        knots: list[float] = []
        rows: list[Array] = []
        inside, w = np.zeros(len(middle)), self.width
        if self.lower is not None:
            knots += [self.lower - 2 * w, self.lower - w]
            rows += [_reflected(far, w), _reflected(middle, w)]
        knots.append(self.lower if self.lower is not None else (self.upper or 0.0) - w)
        rows.append(inside)
        if self.upper is not None:
            knots += [self.upper, self.upper + w]
            rows += [middle, far]
        return Profile(np.array(knots), np.array(rows))

    @cached_property
    def potential(self) -> Profile:
        k, w, n = self.stiffness, self.width, len(STEP)
        middle = np.zeros(n + 2)
        middle[2:] = [k * s * w**2 / ((j + 1) * (j + 2)) / w ** (j + 2) for j, s in enumerate(STEP)]
        far = np.zeros(n + 2)
        powers = w ** np.arange(n + 2)
        far[:3] = middle @ powers, (middle[1:] * np.arange(1, n + 2)) @ powers[:-1], k / 2
        return self._beyond(middle, far)

    @cached_property
    def contact(self) -> Profile:
        """Damping at a coordinate."""
        n, w = len(STEP), self.width
        far = np.zeros(n)
        far[0] = self.damping
        return self._beyond(self.damping * np.array(STEP) / w ** np.arange(n), far)

    @property
    def stiffest(self) -> float:
        return self.stiffness

    def force(self, q: Array, u: Array) -> Array:
        return self.potential(q)[1] + self.contact(q)[0] * u

    def power(self, q: Array, u: Array) -> Array:
        return self.contact(q)[0] * u**2

    def pieces(self) -> list[Piece]:
        out = [(SPRING, self.potential.numbers)]
        return [*out, (CONTACT, self.contact.numbers)] if self.damping else out


@dataclass(frozen=True, eq=False)
class Friction(Law):
    """Coulomb friction, regularised: resisting limit tanh(rate / velocity).

    limit [N, N m]; velocity [m/s, rad/s] below which the joint creeps instead of sticking.
    """

    limit: float = 0.0
    velocity: float = 1e-3

    kind: ClassVar[str] = "friction"

    def __post_init__(self) -> None:
        if self.limit < 0 or not self.velocity > 0:
            raise ValueError(
                f"friction has limit {self.limit:g} and velocity scale {self.velocity:g}; the limit must not be "
                "negative and the scale positive"
            )

    def force(self, q: Array, u: Array) -> Array:
        return self.limit * np.tanh(u / self.velocity)

    def pieces(self) -> list[Piece]:
        return [(FRICTION, np.array([self.limit, self.velocity]))]


@dataclass(frozen=True)
class Latch:
    """Locks freedom number `freedom` when its coordinate reaches `at`.

    Rigid (no stiffness): the rate becomes zero at once, an impact that keeps momentum and takes energy, and the freedom
    is locked from then on. Elastic: a spring and damper about `at` set in, and nothing is lost at once.
    """

    freedom: int = 0
    at: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        if self.stiffness < 0 or self.damping < 0 or (self.damping and not self.stiffness):
            raise ValueError(
                f"a latch has stiffness {self.stiffness:g} and damping {self.damping:g}; they must not be negative, "
                "and damping needs a stiffness"
            )

    @property
    def rigid(self) -> bool:
        """Whether it locks by an impact."""
        return self.stiffness == 0.0


def _reflected(c: Array, w: float) -> Array:
    """Coefficients in powers of x of sum_k c_k (w - x)^k."""
    at = np.array(w)
    return np.array([(-1.0) ** k * float(powers(c, at, k)) / math.factorial(k) for k in range(len(c))])


def _integral(x: ArrayLike, f: ArrayLike, what: str) -> Profile:
    """V(x), zero at x = 0, with V' through the table (n,)."""
    x, f = np.asarray(x, float), np.asarray(f, float)
    if x.ndim != 1 or x.shape != f.shape or len(x) < 2:
        raise ValueError(f"a tabulated {what} needs two equally long lists of at least 2 numbers")
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(f))):
        raise ValueError(f"a tabulated {what} holds a number that is not finite")
    if np.any(np.diff(x) <= 0):
        raise ValueError(f"the first list of a tabulated {what} must ascend: {x.tolist()}")
    from scipy.interpolate import PchipInterpolator

    table = PchipInterpolator(x, f)
    slopes = table(x[[0, -1]], 1)
    rows = np.zeros((len(x) + 1, 5))
    rows[1:-1, 1:] = table.c[::-1].T / np.arange(1, 5)
    rows[0, 1:3] = f[0] - slopes[0], slopes[0] / 2
    rows[-1, 1:3] = f[-1], slopes[-1] / 2
    knots = np.concatenate([[x[0] - 1.0], x])
    for k, step in enumerate(np.diff(knots)):
        rows[k + 1, 0] = rows[k] @ step ** np.arange(5)
    profile = Profile(knots, rows)
    rows[:, 0] -= float(profile(0.0)[0])
    return Profile(knots, rows)
