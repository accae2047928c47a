"""Stops of joints: stiffness and damping that set in beyond a limit."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.noun.table import refuse
from femflex.system.law import CONTACT, ByCoordinate, Elastic, Piece
from femflex.system.profile import STEP, Profile, powers


class Stop(Elastic):
    """Stops at a lower and an upper limit, or one of them: a stiffness and damping that set in beyond it.

    Both rise from nothing over `width` beyond the limit as a smooth step (C3), so the elastic force is C4 in the
    coordinate and an integrator of order 8 follows it with steps of about the time that the width takes.
    """

    kind: Literal["stop"] = "stop"
    """Selects this law: a stop at a lower limit, an upper limit, or both."""
    lower: Annotated[float, ByCoordinate("m")] | None = None
    """Lower limit of the coordinate. Default: none."""
    upper: Annotated[float, ByCoordinate("m")] | None = None
    """Upper limit of the coordinate. Default: none."""
    stiffness: Annotated[float, ByCoordinate("N/m", above=0.0)]
    """Stiffness beyond the limit."""
    damping: Annotated[float, ByCoordinate("N s/m", least=0.0)] = 0.0
    """Damping coefficient beyond the limit."""
    width: Annotated[float, ByCoordinate("m", above=0.0)] = 0.01
    """Depth over which stiffness and damping rise."""

    @model_validator(mode="after")
    def _limits_fit(self) -> Stop:
        if self.lower is None and self.upper is None:
            refuse("a stop needs a lower or an upper limit, or both")
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            refuse(f"the lower limit {self.lower:g} of a stop is not below its upper limit {self.upper:g}")
        return self

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

    def pieces(self) -> list[Piece]:
        """Its potential, and its damping where it has some."""
        return [*super().pieces(), *([(CONTACT, self.contact.numbers)] if self.damping else [])]


def _reflected(c: Array, w: float) -> Array:
    """Coefficients in powers of x of sum_k c_k (w - x)^k."""
    width = np.array(w)
    return np.array([(-1.0) ** k * float(powers(c, width, k)) / math.factorial(k) for k in range(len(c))])
