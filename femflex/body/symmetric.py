"""Fully symmetric tensors, packed: one value for every i <= j <= k (<= l), in lexicographic order.

A symmetric tensor S of degree p over n coordinates stands for the form S d...d = sum over its packed values of
multiplicity x value x (monomial of d). C(n + p - 1, p) values are kept of n^p.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import permutations
from math import comb, factorial

import numpy as np

from femflex.arrays import Array, IntArray


def packed_size(n: int, degree: int) -> int:
    """Number of packed values, C(n + degree - 1, degree)."""
    return comb(n + degree - 1, degree) if n else 0


@lru_cache(maxsize=64)
def packed_indices(n: int, degree: int) -> IntArray:
    """The ascending indices (C, degree) of the packed values, in their order; not to be written to."""
    rows = np.arange(n, dtype=np.int64)[:, None]
    for _ in range(degree - 1):  # every row goes on with its last index and all above it
        last = rows[:, -1]
        counts = n - last
        start = last - (np.cumsum(counts) - counts)
        rows = np.column_stack([np.repeat(rows, counts, axis=0), np.arange(counts.sum()) + np.repeat(start, counts)])
    rows.flags.writeable = False
    return rows


@lru_cache(maxsize=64)
def multiplicity(n: int, degree: int) -> Array:
    """Number of occurrences of each packed value in the full tensor (C,); not to be written to."""
    rows = packed_indices(n, degree)
    number = np.full(len(rows), float(factorial(degree)))
    run = np.ones(len(rows))
    for column in range(1, degree):  # divide by the factorial of every run of equal indices
        run = np.where(rows[:, column] == rows[:, column - 1], run + 1, 1.0)
        number /= run
    number.flags.writeable = False
    return number


def form(packed: Array, d: Array, degree: int) -> float:
    """S d...d of packed values (C,) at d (n,)."""
    rows = packed_indices(len(d), degree)
    return float((multiplicity(len(d), degree) * packed) @ d[rows].prod(axis=1))


def gradient(packed: Array, d: Array, degree: int) -> Array:
    """d(S d...d)/dd = degree x S d...d with one index left free, (n,)."""
    rows = packed_indices(len(d), degree)
    weight, factors = multiplicity(len(d), degree) * packed, d[rows]
    out = np.zeros(len(d))
    for a in range(degree):
        others = np.delete(factors, a, axis=1).prod(axis=1)
        out += np.bincount(rows[:, a], weight * others, len(d))
    return out


def hessian(packed: Array, d: Array, degree: int) -> Array:
    """Second derivative of S d...d, degree (degree - 1) x S d...d with two indices left free, (n, n)."""
    n = len(d)
    rows = packed_indices(n, degree)
    weight, factors = multiplicity(n, degree) * packed, d[rows]
    out = np.zeros(n * n)
    for a, b in permutations(range(degree), 2):
        others = np.delete(factors, (a, b), axis=1).prod(axis=1)
        out += np.bincount(rows[:, a] * n + rows[:, b], weight * others, n * n)
    return out.reshape(n, n)


def packed(full: Array) -> Array:
    """The packed values (C,) of the symmetric part of a full tensor (n, ..., n)."""
    n, degree = full.shape[0], full.ndim
    rows = packed_indices(n, degree)
    orders = list(permutations(range(degree)))
    return sum((full[tuple(rows[:, order].T)] for order in orders), np.zeros(len(rows))) / len(orders)


def unpacked(values: Array, n: int, degree: int) -> Array:
    """The full tensor (n, ..., n) of packed values; for small n."""
    rows = packed_indices(n, degree)
    full = np.zeros((n,) * degree)
    for order in permutations(range(degree)):
        full[tuple(rows[:, order].T)] = values
    return full


def truncated(values: Array, n: int, keep: int, degree: int) -> Array:
    """The packed values (C',) of a tensor, values (C,), restricted to its first `keep` of n coordinates."""
    return values[packed_indices(n, degree)[:, -1] < keep]


def selected(values: Array, n: int, coordinates: IntArray, degree: int) -> Array:
    """The packed values (C',) of a tensor, values (C,), restricted to `coordinates` (k,) of n, in their order."""
    rows = np.sort(coordinates[packed_indices(len(coordinates), degree)], axis=1)
    position = np.zeros(len(rows), np.int64)
    first = np.zeros(len(rows), np.int64)
    for a in range(degree):  # count the packed rows before each: those whose entry a is smaller, after equal ones
        remaining = degree - 1 - a
        below = np.array(
            [0, *np.cumsum([comb(n - v + remaining - 1, remaining) if remaining else 1 for v in range(n)])], np.int64
        )
        position += below[rows[:, a]] - below[first]
        first = rows[:, a]
    return values[position]
