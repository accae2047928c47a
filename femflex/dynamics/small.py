"""Small symmetric positive systems in a flat array: L D L^T factors and solutions in place, without square roots."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.vectors import inner

Array = NDArray[np.float64]


@inner
def factorise(a: Array, n: int) -> None:
    """Replace the lower half of the (n, n) matrix laid flat in a by L D L^T: L below the diagonal, 1/D on it.

    A pivot that is not positive leaves NaN.
    """
    for i in range(n):
        row = a[i * n : (i + 1) * n]
        for j in range(i):  # row[j] becomes L_ij D_j
            other = a[j * n : (j + 1) * n]
            total = row[j]
            for k in range(j):
                total -= row[k] * other[k]
            row[j] = total
        pivot = row[i]
        for j in range(i):
            scaled = row[j] * a[j * n + j]
            pivot -= row[j] * scaled
            row[j] = scaled
        row[i] = 1.0 / pivot if pivot > 0.0 else math.nan


@inner
def solve_factorised(a: Array, n: int, v: Array) -> None:
    """Solve L D L^T x = v in place for v (n,), with the factors that `factorise` left in a."""
    for i in range(n):
        row = a[i * n : (i + 1) * n]
        total = v[i]
        for k in range(i):
            total -= row[k] * v[k]
        v[i] = total
    for i in range(n):
        v[i] *= a[i * n + i]
    for j in range(n):
        i = n - 1 - j
        row = a[i * n : (i + 1) * n]
        for k in range(i):
            v[k] -= row[k] * v[i]
