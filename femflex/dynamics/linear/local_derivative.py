"""Derivatives of forces, rates and channels where they are: by steps as small as the narrowest law at work there.

A limit of a motor, a stop, a cable that is just taut or friction of small rates is linear within its own width alone,
which no size of the craft tells. Central differences are therefore taken with steps that fall by FALL. Of two that
follow one another the pair is chosen that differs by the smallest part, rounding counted: long steps are exact where a
function is of second degree, short ones where it is narrow.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femflex.arrays import Array

STEP_RATIO = 0.01  # of a step to the one before
STEPS = 8  # at most
EPS = 4.0 * float(np.finfo(float).eps)  # rounding of a difference, of the size of what is summed up
ROUNDING_FACTOR = 8.0  # times its rounding: two derivatives that differ by less are the same
CLOSE = 1e-9  # of a derivative: likewise


def local_derivative(f: Callable[[float], Array], first: float, size: ArrayLike = 0.0, steps: int = STEPS) -> Array:
    """Derivative (n,) at 0 of f(h) (n,), a function of a distance h from where it is wanted.

    first  longest step;  size  (n,) or one number: size of the terms that cancel in f, which round off beside f itself
    steps  at most, two where their derivatives are the same
    """
    h = first * STEP_RATIO ** np.arange(steps)
    slope, largest = _difference(f, float(h[0]))
    slopes, rounding = [slope], EPS * np.maximum(largest, size)
    for k in range(1, steps):
        slope, largest = _difference(f, float(h[k]))
        slopes.append(slope)
        rounding = np.maximum(rounding, EPS * largest)
        change = np.abs(slopes[1] - slopes[0])
        if k == 1 and np.all(change <= np.maximum(ROUNDING_FACTOR * rounding / h[1], CLOSE * np.abs(slope))):
            return np.where(change <= ROUNDING_FACTOR * rounding / h[1], slopes[0], slopes[1])
    return _most_alike(np.array(slopes), h, rounding)


def _most_alike(slopes: Array, h: NDArray[np.floating], rounding: Array) -> Array:
    """Return, of slopes (k, n) by falling steps h (k,), the pair with the smallest relative difference."""
    change = np.abs(np.diff(slopes, axis=0))
    # where the shortest step tells another slope it is rounding, or the little that a law of its width changes
    rounding = np.maximum(rounding, change[-1] * h[-1]) / h[1:, None]
    either = np.maximum(np.abs(slopes[1:]), np.abs(slopes[:-1]))
    cost = (change + rounding) / np.maximum(either, 1e-300)
    # of those that are all rounding the longest step has the least of it
    cost = np.where(either > ROUNDING_FACTOR * rounding, cost, 1.0 + np.arange(len(change))[:, None])
    best, column = np.argmin(cost, axis=0), np.arange(slopes.shape[1])
    return np.where(
        change[best, column] <= ROUNDING_FACTOR * rounding[best, column], slopes[best, column], slopes[best + 1, column]
    )


def _difference(f: Callable[[float], Array], h: float) -> tuple[Array, Array]:
    """Central difference of f, and the larger of the two values."""
    ahead, behind = f(h), f(-h)
    return (ahead - behind) / (2.0 * h), np.maximum(np.abs(ahead), np.abs(behind))


def on_line(f: Callable[[Array], Array], direction: Array) -> Callable[[float], Array]:
    """f over the distance along a direction."""
    return lambda h: f(h * direction)
