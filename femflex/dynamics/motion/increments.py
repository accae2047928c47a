"""Increments of the coordinates along the quasi-velocities, and derivatives along them.

Derivatives of forces, rates and channels are taken by steps as small as the narrowest law at work: a limit of a motor,
a stop, a cable that is just taut or friction of small rates is linear within its own width alone, which no size of the
craft tells. Central differences are therefore taken with steps that fall by STEP_RATIO. Of two that follow one another
the pair is chosen that differs by the smallest part, rounding counted: long steps are exact where a function is of
second degree, short ones where it is narrow.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femflex.arrays import Array

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

STEP_RATIO = 0.01  # of a step to the one before
STEPS = 8  # at most
EPS = 4.0 * float(np.finfo(float).eps)  # rounding of a difference, of the size of what is summed up
ROUNDING_FACTOR = 8.0  # times its rounding: two derivatives that differ by less are the same
CLOSE = 1e-9  # of a derivative: likewise
NEWTON_TOLERANCE = 1e-12  # last step of Newton's method for an increment
NEWTON_STEPS = 12  # most steps of that method


def advanced(model: Model, q: Array, increment: Array) -> Array:
    """q o exp(increment): the coordinates (n_q,) after an increment (n_u,) along the quasi-velocities."""
    out = np.array(q, float)
    model.second_order.advance(
        np.ascontiguousarray(q), np.ascontiguousarray(increment), out, model.table, model.pool, model.work
    )
    return out


def displaced(
    model: Model, x: Array, dxi: Array | None = None, du: Array | float = 0.0, dz: Array | float = 0.0
) -> Array:
    """The state (n_x,) beside x: coordinates after the increment dxi (n_u,), rates and states z with du, dz added."""
    q, u, z = model.parts(x)
    return np.concatenate([q if dxi is None else advanced(model, q, dxi), u + du, z + dz])


def increment_between(model: Model, q: Array, p: Array) -> Array:
    """The increment (n_u,) [SI] along the quasi-velocities that leads from coordinates q (n_q,) to p.

    By Newton's method. Quaternions of either sign are the same attitude, and angles count modulo 2 pi.
    """
    q, p, n = np.asarray(q, float), np.array(p, float), model.n_u
    for first in model.renormalise:
        four = slice(int(first), int(first) + 4)
        if p[four] @ q[four] < 0:
            p[four] = -p[four]
    turns = np.array([unit == "rad" for _, unit in model.system.coordinate_names()], bool)
    solution, h = np.zeros(n), 1e-6
    for _ in range(NEWTON_STEPS if n else 0):
        reached = advanced(model, q, solution)
        change = p - reached
        change[turns] -= 2 * np.pi * np.round(change[turns] / (2 * np.pi))
        columns = [
            (advanced(model, q, solution + h * e) - advanced(model, q, solution - h * e)) / (2 * h) for e in np.eye(n)
        ]
        step = np.linalg.lstsq(np.column_stack(columns), change, rcond=None)[0]
        solution = solution + step
        if np.abs(step).max() <= NEWTON_TOLERANCE * max(1.0, float(np.abs(solution).max())):
            break
    return solution


def jacobian(f: Callable[[Array], Array], first: Array, size: ArrayLike = 0.0, steps: int = STEPS) -> Array:
    """Derivatives (m, n) at 0 of f(d) (m,) along each coordinate of d (n,); first (n,): their longest steps.

    size, steps: as of `local_derivative`
    """
    columns = [
        local_derivative(on_line(f, e), float(step), size, steps)
        for e, step in zip(np.eye(len(first)), first, strict=True)
    ]
    return np.column_stack(columns) if columns else np.zeros((len(f(np.zeros(0))), 0))


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


def on_line(f: Callable[[Array], Array], direction: Array) -> Callable[[float], Array]:
    """f over the distance along a direction."""
    return lambda h: f(h * direction)


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
