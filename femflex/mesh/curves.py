"""Points along curves and polylines in space."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array

ARC_SAMPLES = 4000  # number of chords used to measure the length of a curve


def along_curve(curve: Callable[[float], ArrayLike], n: int) -> Array:
    """Points (n + 1, 3) [m] on the curve, at equal steps of its arc length."""
    parameter = np.linspace(0.0, 1.0, ARC_SAMPLES + 1)
    samples = np.array([np.asarray(curve(float(s)), float).reshape(3) for s in parameter])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(samples, axis=0), axis=1))])
    parameters = np.interp(length[-1] * np.linspace(0, 1, n + 1), length, parameter)
    return np.array([np.asarray(curve(float(s)), float).reshape(3) for s in parameters])


def along_polyline(corners: Array, n: int, order: int) -> Array:
    """Points (n + 1, 3) [m] on a polyline with n cells distributed over its legs in proportion to their length, at
    least one each."""
    if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) < 2:
        raise ValueError(f"a polyline is an array (k, 3) of at least 2 points [m]; got shape {corners.shape}.")
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if not (lengths > 0).all():
        raise ValueError(f"points {np.argmin(lengths)} and {np.argmin(lengths) + 1} of the polyline coincide.")
    if n < len(lengths):
        raise ValueError(f"a polyline of {len(lengths)} legs needs at least as many cells; n is {n}.")
    counts = np.ones(len(lengths), int)
    for _ in range(n - len(lengths)):
        counts[np.argmax(lengths / counts)] += 1  # the leg with the longest cells gets the next one
    parts = [
        a + (b - a) * (np.arange(count * order) / (count * order))[:, None]
        for a, b, count in zip(corners[:-1], corners[1:], counts, strict=True)
    ]
    return np.concatenate([*parts, corners[-1:]])
