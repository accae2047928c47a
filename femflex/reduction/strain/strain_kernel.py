"""Compiled: quadratic strain of pairs of shapes at points, in the layout that one matrix product contracts."""

from __future__ import annotations

from typing import Any

import numba
import numba.types
import numpy as np

from femflex.arrays import Array, IntArray
from femflex.kernels.compiled import part_options, stored

types: Any = numba.types  # numba's own annotations do not cover all of it
njit: Any = numba.njit

TILE = 256  # points taken at once: what they need stays in cache
_VECTOR, _INDICES, _BLOCK = types.float64[::1], types.int64[::1], types.float64[:, :, ::1]
_FILL = types.void(_BLOCK, _BLOCK, _INDICES, _INDICES, _INDICES, _VECTOR)
_MIX = types.void(_BLOCK, _BLOCK)
_part = njit(**part_options())


@_part
def _scale(out: Array, factor: float, a: Array) -> None:
    for x in range(len(a)):
        out[x] = factor * a[x]


@_part
def _set_product(out: Array, a: Array, b: Array) -> None:
    for x in range(len(out)):
        out[x] = a[x] * b[x]


@_part
def _set_two(out: Array, a: Array, b: Array, c: Array, d: Array) -> None:
    for x in range(len(out)):
        out[x] = a[x] * b[x] + c[x] * d[x]


@_part
def _add_product(out: Array, a: Array, b: Array) -> None:
    for x in range(len(out)):
        out[x] += a[x] * b[x]


@_part
def _add_three(out: Array, a: Array, b: Array, c: Array, d: Array, e: Array, f: Array) -> None:
    for x in range(len(out)):
        out[x] += a[x] * b[x] + c[x] * d[x] + e[x] * f[x]


@_part
def _sum_products(out: Array, left: Array, g: Array, column: IntArray, j: int, start: int) -> None:
    """The sum over k of left[k] g[column[k], j, start:], three of them in one pass: loads and stores take the time."""
    end, k = start + len(out), len(column) % 3
    if k == 0:
        out[:] = 0.0
    elif k == 1:
        _set_product(out, left[0], g[column[0], j, start:end])
    else:
        _set_two(out, left[0], g[column[0], j, start:end], left[1], g[column[1], j, start:end])
    while k < len(column):
        a, b, c = g[column[k], j, start:end], g[column[k + 1], j, start:end], g[column[k + 2], j, start:end]
        _add_three(out, left[k], a, left[k + 1], b, left[k + 2], c)
        k += 3


@stored(_FILL, nogil=True)
def fill_pairs(out: Array, g: Array, strain: IntArray, row: IntArray, column: IntArray, value: Array) -> None:
    """Fill out (n(n+1)/2, s, p) with a quadratic strain of all pairs of shapes i <= j from gradients g (rows, n, p).

    Strain q of a pair is the sum of value * g[row, i] * g[column, j] over the entries with strain q, which stand
    together.
    """
    n, p = g.shape[1], g.shape[2]
    first = np.searchsorted(strain, np.arange(out.shape[1] + 1))
    left = np.empty((len(strain), TILE))
    for start in range(0, p, TILE):
        end = min(start + TILE, p)
        at = 0
        for i in range(n):
            for k in range(len(strain)):
                _scale(left[k], value[k], g[row[k], i, start:end])
            for j in range(i, n):
                for q in range(out.shape[1]):
                    own, of = out[at, q, start:end], slice(first[q], first[q + 1])
                    _sum_products(own, left[of], g, column[of], j, start)
                at += 1


@stored(_MIX, nogil=True)
def mix_strains(out: Array, root: Array) -> None:
    """Replace strains out (n_pairs, s, p), in any unit, by root^T times them, root (s, s, p) lower triangular."""
    for pair in range(out.shape[0]):
        for r in range(out.shape[1]):
            own = out[pair, r]
            own *= root[r, r]
            for q in range(r + 1, out.shape[1]):
                _add_product(own, root[q, r], out[pair, q])
