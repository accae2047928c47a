"""Small dense symmetric systems in a flat array: L D L^T in place, and its solution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.compiled import inner

Array = NDArray[np.float64]


@inner
def factorise(a: Array, n: int) -> None:
    """Replace the lower triangle of a (n, n) by L below the diagonal and D on it."""
    for j in range(n):
        for i in range(j + 1, n):
            factor = a[i * n + j] / a[j * n + j]
            for k in range(j + 1, i + 1):
                a[i * n + k] -= factor * a[k * n + j]
        for i in range(j + 1, n):
            a[i * n + j] /= a[j * n + j]


@inner
def solve_factorised(a: Array, n: int, x: Array) -> None:
    """Replace x (n) by the solution of a x = x, a factorised."""
    for i in range(n):
        for k in range(i):
            x[i] -= a[i * n + k] * x[k]
    for i in range(n):
        x[i] /= a[i * n + i]
    for j in range(n):
        i = n - 1 - j
        for k in range(i + 1, n):
            x[i] -= a[k * n + i] * x[k]
