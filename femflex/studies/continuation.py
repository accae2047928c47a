"""Steps along a branch of free vibrations by arc length, which pass folds of amplitude or frequency.

Lengths use the norm of a motion x = (harmonics c, omega): |dx|^2 = sum_k dc_k.Me dc_k / sum_k c_k.Me c_k
+ (d omega / omega)^2, so that a length of 0.1 changes the motion by a tenth. The next motion lies on the normal to the
tangent through the predicted point (pseudo-arclength continuation: Keller, in Applications of Bifurcation Theory
(1977) 359).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.studies.harmonic_balance import HarmonicBalance, Vibration

OFF = 0.3  # distance from the prediction over the step above which the solution may be on another branch
STRAIGHT = 0.9  # cosine between the tangents of two neighbours


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A motion on a branch, the unit tangent (h n + 1,) there, and the row that measures lengths along it."""

    vibration: Vibration
    tangent: Array
    row: Array

    @classmethod
    def from_tangent(cls, problem: HarmonicBalance, vibration: Vibration, tangent: Array) -> BranchPoint:
        """The point of a motion, from a tangent (n_x,) of any length, over harmonics [kg^1/2 m] and frequency
        [rad/s].
        """
        row = metric_row(problem, vibration, tangent)
        length = np.sqrt(row @ tangent)
        return cls(vibration, tangent / length, row / length)


def metric_row(problem: HarmonicBalance, vibration: Vibration, change: Array) -> Array:
    """The row (n_x,), n_x = h n + 1, whose product with another change is the inner product with this one."""
    h, n = vibration.harmonics.shape
    mass = problem.motion.mass[:n, :n]
    size = np.einsum("ki,ij,kj->", vibration.harmonics, mass, vibration.harmonics)
    return np.append((change[:-1].reshape(h, n) @ mass).ravel() / size, change[-1] / vibration.omega**2)


def next_point_on_branch(
    problem: HarmonicBalance, point: BranchPoint, length: float, largest: float
) -> BranchPoint | None:
    """The point one step ahead, or that of amplitude `largest` if it comes first; None where the branch ends."""
    rate = problem.rate(point.vibration, point.tangent)
    exact = rate > 0 and point.vibration.amplitude + length * rate >= largest
    if exact:
        length = (largest - point.vibration.amplitude) / rate
    next_point = _continuation(problem, point, length, largest if exact else None)
    is_beyond = next_point is not None and next_point.vibration.amplitude > largest
    return (
        point_of_smaller_amplitude(problem, next_point, largest) if next_point is not None and is_beyond else next_point
    )


def point_of_smaller_amplitude(problem: HarmonicBalance, point: BranchPoint, amplitude: float) -> BranchPoint | None:
    """The point of a smaller amplitude, back along the branch; None where the branch does not continue there."""
    rate = problem.rate(point.vibration, point.tangent)
    return (
        _continuation(problem, point, (amplitude - point.vibration.amplitude) / rate, amplitude) if rate > 0 else None
    )


def _continuation(
    problem: HarmonicBalance, point: BranchPoint, length: float, amplitude: float | None
) -> BranchPoint | None:
    """The point one step ahead, if it continues the branch: on the normal there, or with an amplitude."""
    x = point.vibration.x + length * point.tangent
    start = Vibration(amplitude or 0.0, float(x[-1]), x[:-1].reshape(point.vibration.harmonics.shape))
    solution = problem.balanced(start, point.row if amplitude is None else None) if start.omega > 0 else None
    if solution is None or solution.omega <= 0:
        return None
    miss = solution.x - x
    next_point = BranchPoint.from_tangent(problem, solution, problem.tangent(solution, point.row))
    cosine = (
        point.row
        @ next_point.tangent
        / np.sqrt(next_point.tangent @ metric_row(problem, point.vibration, next_point.tangent))
    )
    is_close = np.sqrt(miss @ metric_row(problem, point.vibration, miss)) < OFF * abs(length)
    return next_point if is_close and cosine > STRAIGHT else None
