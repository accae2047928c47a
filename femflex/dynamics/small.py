"""Small symmetric systems in a flat array: Cholesky factors and triangular solves in place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from femflex.dynamics.vectors import FAST

Array = NDArray[np.float64]


@njit(cache=True, fastmath=FAST)
def cholesky(a: Array, at: int, n: int) -> None:
    """Replace the (n, n) matrix at a[at:] by its lower Cholesky factor; a pivot that is not positive leaves NaN."""
    for i in range(n):
        row = at + i * n
        for j in range(i):
            other = at + j * n
            total = a[row + j]
            for k in range(j):
                total -= a[row + k] * a[other + k]
            a[row + j] = total / a[other + j]
        total = a[row + i]
        for k in range(i):
            total -= a[row + k] * a[row + k]
        a[row + i] = math.sqrt(total) if total > 0.0 else math.nan


@njit(cache=True, fastmath=FAST)
def solve_cholesky(a: Array, at: int, n: int, v: Array, x: int) -> None:
    """Solve L L^T x = v in place for the vector v[x : x + n], with the factor L at a[at:]."""
    for i in range(n):
        total = v[x + i]
        for k in range(i):
            total -= a[at + i * n + k] * v[x + k]
        v[x + i] = total / a[at + i * n + i]
    for j in range(n):
        i = n - 1 - j
        total = v[x + i]
        for k in range(i + 1, n):
            total -= a[at + k * n + i] * v[x + k]
        v[x + i] = total / a[at + i * n + i]
