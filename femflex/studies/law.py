"""Laws by which an error decreases, and the trend of a sequence of values towards its limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array

Kind = Literal["algebraic", "geometric"]
State = Literal["one", "few", "constant", "law", "rounded", "settling", "swinging", "unsettled"]


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
