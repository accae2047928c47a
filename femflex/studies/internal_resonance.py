"""Continuation of a branch beyond an internal resonance, where it leads into vibrations of another mode (a tongue)."""

from __future__ import annotations

import numpy as np

from femflex.studies.continuation import BranchPoint, next_point_on_branch, point_of_smaller_amplitude
from femflex.studies.harmonic_balance import HarmonicBalance

LEADING = 0.5  # share that the first harmonic has in a motion of the branch
OUTSIDE_SHARE = 0.95  # of the largest share before: points below it are in the tongue already
SHORT, FARTHEST = 0.02, 2.0  # steps over a tongue along the arc
BACK = (1, 2, 3, 4, 6, 9, 13)  # which of the last points outside the tongue the steps start from
CLEAR = 2e-3  # relative increase of amplitude from which on a point counts as beyond the tongue
LEAST = 5e-3  # of an amplitude: smallest step of the search for the far side


def beyond_resonance(problem: HarmonicBalance, points: list[BranchPoint], amplitude: float) -> BranchPoint | None:
    """The point of least amplitude beyond a tongue, or that of a requested amplitude; None if none is found.

    points: in order along the branch, up to or into the tongue.
    """
    turn = int(np.argmax([point.vibration.amplitude for point in points]))
    peak = points[turn].vibration.amplitude
    shares = np.array([first_share(problem, point) for point in points[: turn + 1]])
    least = OUTSIDE_SHARE * shares.max()
    outside = np.flatnonzero(shares > least)
    for point in (points[outside[-back]] for back in BACK if back <= len(outside)):
        rate = problem.rate(point.vibration, point.tangent)
        length = max(SHORT, (peak - point.vibration.amplitude) / rate) if rate > 0 else np.inf
        while length < FARTHEST:
            candidate = next_point_on_branch(problem, point, length, np.inf)
            if (
                candidate is not None
                and candidate.vibration.amplitude > (1 + CLEAR) * peak
                and first_share(problem, candidate) > least
            ):
                return _far_side(problem, peak, candidate, amplitude)
            length *= 1.5
    return None


def first_share(problem: HarmonicBalance, point: BranchPoint) -> float:
    """Share of the first harmonic in the mean square of the motion about its mean, weighed by mass."""
    harmonics = point.vibration.harmonics
    n = harmonics.shape[1]
    squares = np.einsum("ki,ij,kj->k", harmonics[1:], problem.motion.mass[:n, :n], harmonics[1:])
    return float(squares[0] / squares.sum())


def _far_side(problem: HarmonicBalance, peak: float, point: BranchPoint, amplitude: float) -> BranchPoint:
    """The point at the far side of a tongue, or of a requested amplitude, reached downwards from a point beyond."""
    lowest = amplitude if peak < amplitude < point.vibration.amplitude else peak
    step = (point.vibration.amplitude - lowest) / 2
    while point.vibration.amplitude > lowest and step > LEAST * peak:
        lower = point_of_smaller_amplitude(problem, point, max(lowest, point.vibration.amplitude - step))
        if lower is None:
            step /= 2
        else:
            point = lower
    return point
