"""Stops of joints: stiffness and damping that set in beyond a limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.system.law import CONTACT, SPRING, Elastic, Piece
from femflex.system.profile import STEP, Profile, powers


@dataclass(frozen=True, eq=False)
class Stop(Elastic):
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

    def _piecewise(self, middle: Array, outside: Array) -> Profile:
        """0 inside; at a depth d beyond a limit `middle` in powers of d, past the width `far` in those of d - w."""
        knots: list[float] = []
        rows: list[Array] = []
        inside, w = np.zeros(len(middle)), self.width
        if self.lower is not None:
            knots += [self.lower - 2 * w, self.lower - w]
            rows += [_reflected(outside, w), _reflected(middle, w)]
        knots.append(self.lower if self.lower is not None else (self.upper or 0.0) - w)
        rows.append(inside)
        if self.upper is not None:
            knots += [self.upper, self.upper + w]
            rows += [middle, outside]
        return Profile(np.array(knots), np.array(rows))

    @cached_property
    def potential(self) -> Profile:
        k, w, n = self.stiffness, self.width, len(STEP)
        middle = np.zeros(n + 2)
        middle[2:] = [k * s * w**2 / ((j + 1) * (j + 2)) / w ** (j + 2) for j, s in enumerate(STEP)]
        outside = np.zeros(n + 2)
        powers = w ** np.arange(n + 2)
        outside[:3] = middle @ powers, (middle[1:] * np.arange(1, n + 2)) @ powers[:-1], k / 2
        return self._piecewise(middle, outside)

    @cached_property
    def contact(self) -> Profile:
        """Damping at a coordinate."""
        n, w = len(STEP), self.width
        outside = np.zeros(n)
        outside[0] = self.damping
        return self._piecewise(self.damping * np.array(STEP) / w ** np.arange(n), outside)

    @property
    def stiffest(self) -> float:
        return self.stiffness

    def force(self, q: Array, u: Array) -> Array:
        return self.potential(q)[1] + self.contact(q)[0] * u

    def power(self, q: Array, u: Array) -> Array:
        return self.contact(q)[0] * u**2

    def kernel_pieces(self) -> list[Piece]:
        out = [(SPRING, self.potential.numbers)]
        return [*out, (CONTACT, self.contact.numbers)] if self.damping else out


def _reflected(c: Array, w: float) -> Array:
    """Coefficients in powers of x of sum_k c_k (w - x)^k."""
    width = np.array(w)
    return np.array([(-1.0) ** k * float(powers(c, width, k)) / math.factorial(k) for k in range(len(c))])
