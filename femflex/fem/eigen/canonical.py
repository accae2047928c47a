"""A unique choice among the many equivalent sets of modes: order, sign, and the basis inside a degenerate cluster.

An eigen-solver returns a mode up to its sign and a repeated frequency up to any rotation of its shapes; which one
depends on rounding. The rules here depend only on the span of the shapes, so that a run is repeatable on any machine.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from femflex.arrays import Array

CLOSE = 1e-3  # relative gap of natural frequencies below which a truncation must not separate them
DEGENERATE = 1e-8  # relative gap of eigenvalues below which the shapes are any basis of their span
TIE = 1e-6  # relative difference below which two entries count as equally large; the first wins


def canonical_modes(eigenvalues: Array, phi: Array) -> Array:
    """Return the modes phi (n_dof, n) with a fixed basis in each degenerate cluster and fixed signs.

    eigenvalues (n,) ascend. Inside a cluster the basis is the pivoted echelon form: the row of largest norm (which no
    rotation changes) is rotated into the first shape only, then the largest of the rest into the second, and so on.
    """
    phi = phi.copy()
    for cluster in clusters(eigenvalues, DEGENERATE):
        if cluster.stop - cluster.start > 1:
            phi[:, cluster] = _echelon(phi[:, cluster])
    return phi * signs(phi)


def clusters(eigenvalues: Array, gap: float) -> list[slice]:
    """Runs of ascending eigenvalues (n,), in any unit, whose neighbours differ by less than a relative gap."""
    scale = np.maximum(np.abs(eigenvalues[1:]), np.abs(eigenvalues[:-1]))
    breaks = np.flatnonzero(np.diff(eigenvalues) > gap * scale) + 1
    edges = [0, *breaks.tolist(), len(eigenvalues)]
    return [slice(a, b) for a, b in pairwise(edges) if b > a]


def count_without_split_cluster(omega: Array, n: int) -> int | None:
    """Return the smallest count m >= n that splits no close pair m, m + 1; None when omega (k,) is too short to
    decide."""
    for m in range(n, len(omega)):
        if omega[m] - omega[m - 1] > CLOSE * omega[m]:
            return m
    return None


def signs(phi: Array) -> Array:
    """Sign (n,) [1] of each column's largest entry; among entries that tie, the first."""
    size = np.abs(phi)
    largest = np.argmax(size >= (1 - TIE) * size.max(axis=0), axis=0)
    return np.where(phi[largest, np.arange(phi.shape[1])] < 0, -1.0, 1.0)


def _echelon(phi: Array) -> Array:
    """Columns of phi rotated so that each pivot row is zero in the columns after its own."""
    rotation = np.eye(phi.shape[1])
    for j in range(phi.shape[1] - 1):
        rest = phi @ rotation[:, j:]
        norms = np.linalg.norm(rest, axis=1)
        pivot = rest[int(np.argmax(norms >= (1 - TIE) * norms.max()))]
        # an orthogonal matrix whose first column is along the pivot row
        Q, _ = np.linalg.qr(np.column_stack([pivot, np.eye(len(pivot))]))
        rotation[:, j:] = rotation[:, j:] @ Q
    return phi @ rotation
