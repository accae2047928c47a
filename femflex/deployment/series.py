"""Laurent polynomials in the length ratio lambda = L / L_0, with arrays as coefficients: power -> array."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femflex.arrays import Array

Series = dict[int, Array]


def added(*parts: Series) -> Series:
    """Sum of series."""
    out: Series = {}
    for part in parts:
        for power, value in part.items():
            out[power] = out[power] + value if power in out else value
    return out


def scaled(series: Series, factor: float, shift: int = 0) -> Series:
    """factor lambda^shift times a series."""
    return {power + shift: factor * value for power, value in series.items()}


def mapped(series: Series, change: Callable[[Array], Array]) -> Series:
    """The series with a linear map applied to every coefficient (...), in any unit."""
    return {power: change(value) for power, value in series.items()}


def product(a: Series, b: Series, contract: Callable[[Array, Array], Array]) -> Series:
    """Product of two series whose coefficients (...), in any units, are multiplied by `contract`."""
    return added(*({p + q: contract(x, y)} for p, x in a.items() for q, y in b.items()))


def derivative(series: Series) -> Series:
    """d/dlambda of a series."""
    return {power - 1: power * value for power, value in series.items() if power}


def evaluate(series: Series, ratio: float) -> Array:
    """The sum (...) of a series at lambda = ratio [1]."""
    return np.asarray(sum(value * float(ratio) ** power for power, value in series.items()), float)
