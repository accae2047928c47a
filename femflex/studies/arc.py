"""Steps along a branch of free vibrations, by the length of its arc: folds of amplitude or frequency are no obstacle.

Lengths are taken with the measure of a motion x = (harmonics c, omega): |dx|^2 = sum_k dc_k.Me dc_k / sum_k c_k.Me c_k
+ (d omega / omega)^2, so that one of 0.1 changes the motion by a tenth. The motion sought lies across the tangent from
the point predicted on it (pseudo-arclength continuation: Keller, in Applications of Bifurcation Theory (1977) 359).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.studies.harmonic_balance import HarmonicBalance, Vibration

OFF = 0.3  # distance from the prediction over the step, above which another branch may have been met
STRAIGHT = 0.9  # cosine between the tangents of two neighbours


@dataclass(frozen=True, eq=False)
class Place:
    """A motion on a branch, the unit tangent (h n + 1,) there, and the row that measures lengths along it."""

    at: Vibration
    tangent: Array
    row: Array

    @classmethod
    def of(cls, problem: HarmonicBalance, at: Vibration, tangent: Array) -> Place:
        """The place of a motion, from a tangent (n_x,) of any length, over harmonics [kg^1/2 m] and frequency
        [rad/s]."""
        row = measured(problem, at, tangent)
        length = np.sqrt(row @ tangent)
        return cls(at, tangent / length, row / length)


def measured(problem: HarmonicBalance, at: Vibration, change: Array) -> Array:
    """The row (n_x,), n_x = h n + 1, whose product with another change is the inner product with this one."""
    h, n = at.harmonics.shape
    mass = problem.motion.mass[:n, :n]
    size = np.einsum("ki,ij,kj->", at.harmonics, mass, at.harmonics)
    return np.append((change[:-1].reshape(h, n) @ mass).ravel() / size, change[-1] / at.omega**2)


def stepped(problem: HarmonicBalance, here: Place, length: float, most: float) -> Place | None:
    """The place so far on, or that with the amplitude `most` where this comes first; None where none continues here."""
    rate = problem.rate(here.at, here.tangent)
    exact = rate > 0 and here.at.amplitude + length * rate >= most
    if exact:
        length = (most - here.at.amplitude) / rate
    to = _found(problem, here, length, most if exact else None)
    past = to is not None and to.at.amplitude > most
    return nearer(problem, to, most) if to is not None and past else to


def nearer(problem: HarmonicBalance, here: Place, amplitude: float) -> Place | None:
    """The place with a smaller amplitude, back along the branch; None where none continues it."""
    rate = problem.rate(here.at, here.tangent)
    return _found(problem, here, (amplitude - here.at.amplitude) / rate, amplitude) if rate > 0 else None


def _found(problem: HarmonicBalance, here: Place, length: float, amplitude: float | None) -> Place | None:
    """The place so far on, if it continues here: across the tangent there, or with an amplitude."""
    x = here.at.x + length * here.tangent
    start = Vibration(amplitude or 0.0, float(x[-1]), x[:-1].reshape(here.at.harmonics.shape))
    to = problem.balanced(start, here.row if amplitude is None else None) if start.omega > 0 else None
    if to is None or to.omega <= 0:
        return None
    off = to.x - x
    there = Place.of(problem, to, problem.tangent(to, here.row))
    straight = here.row @ there.tangent / np.sqrt(there.tangent @ measured(problem, here.at, there.tangent))
    near = np.sqrt(off @ measured(problem, here.at, off)) < OFF * abs(length)
    return there if near and straight > STRAIGHT else None
