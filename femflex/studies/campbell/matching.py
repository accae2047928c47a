"""Mode tracking: which vibration at one speed continues which vibration at the speed before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.dynamics.linear.small_motions import SmallMotions

ONE = 1e-6  # relative difference of frequencies below which shapes may mix arbitrarily
SINGLE = 1e-2  # weight of the MAC of single shapes, which decides within a space of mixtures
STEADY = 3.0  # weight of frequency differences between speeds as close as possible, where no frequency jumps
NUDGE = 1e-6  # weight of frequency differences, which decides only between equal MACs


@dataclass(frozen=True, eq=False)
class Match:
    """Continuation of vibrations: the k-th of the first speed is the `to[k]`-th of the next, -1 where it is lost.

    worst: smallest MAC (0 to 1) of those that are among the lowest at either speed
    """

    to: IntArray
    worst: float


def match_vibrations(before: SmallMotions, after: SmallMotions, count: int, close: bool = False) -> Match:
    """The assignment with the largest MACs; the `count` lowest of both count for `worst`.

    close: between two speeds so close that frequencies hardly change; each is assigned to one of similar frequency.
    """
    single, mixed = modal_assurance(before, after)
    a, b = np.abs(before.eigenvalues), np.abs(after.eigenvalues)
    frequency_difference = np.abs(a[:, None] - b) / np.maximum(np.maximum(a[:, None], b), 1e-300)
    rows, columns = linear_sum_assignment((STEADY if close else NUDGE) * frequency_difference - SINGLE * single - mixed)
    to = np.full(len(a), -1, np.int64)
    to[rows] = columns
    counted = (rows < count) | (columns < count)
    return Match(to, float(mixed[rows, columns][counted].min(initial=1.0)))


def modal_assurance(before: SmallMotions, after: SmallMotions) -> tuple[Array, Array]:
    """|conj(phi_i) . M phi_j|^2 (n_before, n_after) of mass-normalised shapes: the mass-weighted MAC.

    It is returned for single shapes, and with mixtures allowed. Shapes of one frequency, such as flap and lag of a
    round blade at rest, may be mixed arbitrarily, so the part of phi_j within their space counts.
    """
    cross = before.shapes.conj().T @ after.M @ after.shapes
    single = np.minimum(np.abs(cross) ** 2, 1.0)
    mixed = np.maximum(
        _assurance_of_mixtures(before, cross, single), _assurance_of_mixtures(after, cross.conj().T, single.T).T
    )
    return single, np.minimum(mixed, 1.0)


def _assurance_of_mixtures(vibration: SmallMotions, cross: ComplexArray, single: Array) -> Array:
    """MAC (n, n_other) with respect to the space of all shapes of the frequency of each."""
    size = np.abs(vibration.eigenvalues)
    differences = np.abs(vibration.eigenvalues[:, None] - vibration.eigenvalues)
    is_equal = differences <= ONE * np.maximum(size[:, None], size)
    out = single.copy()
    for k in np.flatnonzero(is_equal.sum(axis=1) > 1):
        equal_shapes = vibration.shapes[:, is_equal[k]]
        gram = equal_shapes.conj().T @ vibration.M @ equal_shapes
        coefficients = np.linalg.lstsq(gram, cross[is_equal[k]], rcond=1e-9)[0]
        out[k] = np.einsum("ij,ij->j", cross[is_equal[k]].conj(), coefficients).real
    return out
