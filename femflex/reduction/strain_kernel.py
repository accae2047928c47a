"""Compiled: quadratic strain of pairs of shapes at points, in the layout that one matrix product contracts."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TILE = 128  # points taken at once: what they need stays in cache


@njit(cache=True)
def fill_pairs(out: Array, g: Array, strain: Index, row: Index, column: Index, value: Array) -> None:
    """Fill out (n(n+1)/2, s, p) with a quadratic strain of all pairs of shapes i <= j from gradients g (rows, n, p).

    Strain q of a pair is the sum of value * g[row, i] * g[column, j] over the entries with strain q.
    """
    n, p = g.shape[1], g.shape[2]
    for start in range(0, p, TILE):
        end = min(start + TILE, p)
        at = 0
        for i in range(n):
            for j in range(i, n):
                out[at, :, start:end] = 0.0
                for k in range(len(strain)):
                    _add_product(
                        out[at, strain[k], start:end], value[k], g[row[k], i, start:end], g[column[k], j, start:end]
                    )
                at += 1


@njit(cache=True)
def mix_strains(out: Array, root: Array) -> None:
    """Replace strains out (pairs, s, p) by root^T times them, root (s, s, p) lower triangular."""
    for pair in range(out.shape[0]):
        for r in range(out.shape[1]):
            own = out[pair, r]
            own *= root[r, r]
            for q in range(r + 1, out.shape[1]):
                _add_product(own, 1.0, root[q, r], out[pair, q])


@njit(cache=True)
def _add_product(out: Array, factor: float, a: Array, b: Array) -> None:
    for x in range(len(out)):
        out[x] += factor * a[x] * b[x]
