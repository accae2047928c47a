"""Compiled small change of the kernels: unit quaternions, finiteness, and what every method notes of its steps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.integrate import resume as head
from femflex.integrate.compiled import part

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@part
def put(source: Array, target: Array) -> None:
    """Set target[:] = source; a plain loop compiles in a tenth of the time a checked slice takes."""
    for i in range(target.size):
        target[i] = source[i]


@part
def clipped(t: float, lo: float, hi: float) -> float:
    """Time t held within lo..hi, so that the model is never asked on or beyond a break."""
    return min(max(t, lo), hi)


@part
def cut(t: float, h: float, end: float) -> float:
    """Step h, shortened to land on `end`; the last two steps share what is left so that neither is tiny."""
    left = end - t
    if h * 1.01 >= left:
        return left
    return 0.5 * left if 2.0 * h > left else h


@part
def standing(row: int, n_rows: int, wanted: float, end: float, budget: int, state: Array) -> int:
    """How a kernel call ends before the next trial step of size `wanted`: FULL, END, PAUSE, STUCK, or GO_ON."""
    t = state[head.T]
    if row == n_rows:
        return head.FULL
    if t >= end:
        return head.END
    if budget == 0:
        return head.PAUSE
    if not (wanted >= head.TINY * abs(t) and wanted >= head.TINIEST * abs(end)):  # not a number is stuck as well
        return head.STUCK
    return head.GO_ON


@part
def retreat(h_new: float, state: Array) -> None:
    """Shorten the step after one at whose end the constraints contradict each other."""
    state[head.REJECTED] += 1
    state[head.REJECTED_LAST] = 1.0
    state[head.CAUSE], state[head.COORDINATE], state[head.H] = head.UNHELD, -1, h_new


@part
def normalise(x: Array, renormalise: IntArray) -> None:
    """Bring the four Euler parameters at each position of `renormalise` to unit length, in place."""
    for start in renormalise:
        length = math.sqrt(x[start] ** 2 + x[start + 1] ** 2 + x[start + 2] ** 2 + x[start + 3] ** 2)
        for i in range(start, start + 4):
            x[i] /= length


@part
def first_not_finite(v: Array) -> int:
    """Index of the first entry of v that is not finite, or -1."""
    for i in range(v.size):
        if not math.isfinite(v[i]):
            return i
    return -1


@part
def accept(t_new: float, h: float, wanted: float, factor: float, error: float, dense: bool, state: Array) -> None:
    """Note an accepted step in the state: time, statistics, and the next step h * factor.

    A step cut short at an end says little about the next one, so at least the `wanted` size is kept; after a
    rejection the step does not grow.
    """
    if state[head.REJECTED_LAST] == 1.0:
        factor = min(factor, 1.0)
    state[head.H] = max(h * factor, wanted) if h < wanted else h * factor
    state[head.REJECTED_LAST] = 0.0
    state[head.ERROR] = max(error, 1e-4)
    state[head.T_OLD], state[head.T] = state[head.T], t_new
    state[head.DENSE] = 1.0 if dense else 0.0
    state[head.ACCEPTED] += 1
    state[head.SMALLEST] = min(state[head.SMALLEST], h)
    state[head.LARGEST] = max(state[head.LARGEST], h)
