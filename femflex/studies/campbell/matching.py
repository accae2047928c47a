"""Which vibration of a craft continues which, from one speed to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.dynamics.equilibria.small_motions import SmallMotions

ONE = 1e-6  # relative difference of frequencies below which shapes may mix as they like
OWN = 1e-2  # weight of the likeness of single shapes, which decides within a space of mixtures
STEADY = 3.0  # weight of frequencies apart between speeds that are as close as can be: none jumps there
NUDGE = 1e-6  # weight of frequencies apart, which decides where nothing else does


@dataclass(frozen=True, eq=False)
class Match:
    """How vibrations go on: the k-th of the first speed is the `to[k]`-th of the next, -1 where it is lost.

    worst: least likeness (0 to 1) of those that are among the lowest at either speed
    """

    to: IntArray
    worst: float


def match(first: SmallMotions, last: SmallMotions, count: int, close: bool = False) -> Match:
    """The assignment that makes shapes most alike; the `count` lowest of both count for `worst`.

    close: between two speeds so close that frequencies hardly change; each goes to one nearby, though shapes change.
    """
    single, alike = likeness(first, last)
    a, b = np.abs(first.eigenvalues), np.abs(last.eigenvalues)
    apart = np.abs(a[:, None] - b) / np.maximum(np.maximum(a[:, None], b), 1e-300)
    rows, columns = linear_sum_assignment((STEADY if close else NUDGE) * apart - OWN * single - alike)
    to = np.full(len(a), -1, np.int64)
    to[rows] = columns
    counted = (rows < count) | (columns < count)
    return Match(to, float(alike[rows, columns][counted].min(initial=1.0)))


def likeness(first: SmallMotions, last: SmallMotions) -> tuple[Array, Array]:
    """|conj(phi_i) . M phi_j|^2 (n_first, n_last) of shapes of mass 1: the modal assurance criterion over the mass.

    Of single shapes, and with mixtures allowed: shapes of one frequency, such as flap and lag of a round blade at
    rest, are any mixture of each other, and what counts for them is the part of phi_j within their space.
    """
    cross = first.shapes.conj().T @ last.M @ last.shapes
    single = np.minimum(np.abs(cross) ** 2, 1.0)
    mixed = np.maximum(_within(first, cross, single), _within(last, cross.conj().T, single.T).T)
    return single, np.minimum(mixed, 1.0)


def _within(vibration: SmallMotions, cross: ComplexArray, single: Array) -> Array:
    """Likeness (n, other) to the space of all shapes of the frequency of each."""
    size = np.abs(vibration.eigenvalues)
    near = np.abs(vibration.eigenvalues[:, None] - vibration.eigenvalues)
    same = near <= ONE * np.maximum(size[:, None], size)
    out = single.copy()
    for k in np.flatnonzero(same.sum(axis=1) > 1):
        others = vibration.shapes[:, same[k]]
        gram = others.conj().T @ vibration.M @ others
        parts = np.linalg.lstsq(gram, cross[same[k]], rcond=1e-9)[0]
        out[k] = np.einsum("ij,ij->j", cross[same[k]].conj(), parts).real
    return out
