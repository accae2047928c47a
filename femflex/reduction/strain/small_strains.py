"""Quadratic strain of pairs of shapes by numpy for bodies too small for `strain_kernel` to pay."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray


def fill_pairs(out: Array, g: Array, strain: IntArray, row: IntArray, column: IntArray, value: Array) -> None:
    """Fill out (n(n+1)/2, s, p) as `strain_kernel.fill_pairs` does."""
    first, n = 0, g.shape[1]
    for i in range(n):
        left = value[:, None] * g[row, i]
        for q in range(out.shape[1]):
            entries = strain == q
            out[first : first + n - i, q] = np.einsum("kp,kjp->jp", left[entries], g[column[entries], i:])
        first += n - i


def mix_strains(out: Array, root: Array) -> None:
    """Replace strains out (n_pairs, s, p) by root^T times them, root (s, s, p), as `strain_kernel.mix_strains` does."""
    out[:] = np.einsum("qrp,nqp->nrp", root, out)
