"""Branch of free vibrations of growing amplitude that starts in one mode, without the other periodic solutions.

The equations of harmonic balance have many solutions of an amplitude: other modes, and every motion once more as its
own k-th harmonic at 1/k of the frequency. The branch is therefore followed by arc length (`continuation`), in steps
that are halved until the solution continues it. Where a higher harmonic resonates with another mode the branch leads
into the vibrations of that mode, in a tongue that is often so thin that steps pass it unnoticed. A tongue that is
noticed is stepped over, from where the branch was still straight, and reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array
from femflex.studies.continuation import BranchPoint, next_point_on_branch
from femflex.studies.harmonic_balance import HarmonicBalance, Vibration
from femflex.studies.internal_resonance import LEADING, beyond_resonance, first_share

FIRST, LONGEST, SHORTEST = 0.1, 0.3, 1e-4  # steps along the arc
POINTS = 400  # of one branch
FALLEN = 0.5  # amplitude over the largest one at which the branch is taken to turn back


@dataclass
class Branch:
    """A branch of free vibrations as far as it was followed.

    requested  motions at the requested amplitudes, as far as there are any
    points     all motions in order along the branch
    gaps       (from, to) amplitudes [m] between which a tongue was stepped over
    ended      reason why the branch was followed no further; empty if all amplitudes were reached
    """

    requested: list[Vibration] = field(default_factory=list)
    points: list[Vibration] = field(default_factory=list)
    gaps: list[tuple[float, float]] = field(default_factory=list)
    ended: str = ""


def follow_branch(problem: HarmonicBalance, rest: Vibration, mode: Array, amplitudes: Sequence[float]) -> Branch:
    """The branch from rest to rising amplitudes; mode (h, n) [kg^1/2] are the harmonics at rest per metre of
    amplitude.
    """
    branch = Branch()
    start = _first_point(problem, rest, mode, float(amplitudes[0]))
    if start is None:
        branch.ended = _ending_text(float(amplitudes[0]), rest, "no periodic solution is found beyond it")
        return branch
    points, step_length = [start], FIRST
    for amplitude in map(float, amplitudes):
        reason, step_length = _follow_to(problem, branch, points, amplitude, step_length)
        if reason:
            branch.ended = _ending_text(
                amplitude, max((point.vibration for point in points), key=lambda vibration: vibration.amplitude), reason
            )
            break
        if points[-1].vibration.amplitude == amplitude:
            branch.requested.append(points[-1].vibration)
    branch.points = [point.vibration for point in points]
    return branch


def _first_point(problem: HarmonicBalance, rest: Vibration, mode: Array, amplitude: float) -> BranchPoint | None:
    """A point so close to rest that its motion is that of the mode, at the amplitude or below."""
    row = np.append(mode.ravel(), 0.0)
    for _ in range(60):
        vibration = problem.balanced(Vibration(amplitude, rest.omega, amplitude * mode))
        if vibration is not None and vibration.omega > 0:
            change = float(np.linalg.norm(vibration.harmonics - amplitude * mode) / np.linalg.norm(vibration.harmonics))
            if max(change, abs(vibration.omega / rest.omega - 1)) < FIRST:
                return BranchPoint.from_tangent(problem, vibration, problem.tangent(vibration, row))
        amplitude /= 2
    return None


def _follow_to(
    problem: HarmonicBalance, branch: Branch, points: list[BranchPoint], amplitude: float, length: float
) -> tuple[str, float]:
    """Follow the branch to an amplitude; return the reason for a failure (empty if none), and the next step length."""
    while points[-1].vibration.amplitude < amplitude:
        peak = max(point.vibration.amplitude for point in points)
        next_point = next_point_on_branch(problem, points[-1], length, amplitude)
        reason = _reason_to_reject(problem, next_point, peak, len(points))
        if next_point is None and length > SHORTEST:
            length /= 2
            continue
        if reason:
            next_point, length = beyond_resonance(problem, points, amplitude), FIRST
            if next_point is None:
                return reason, length
            branch.gaps.append((peak, next_point.vibration.amplitude))
        assert next_point is not None
        points.append(next_point)
        length = min(LONGEST, 1.5 * length)
    return "", length


def _reason_to_reject(problem: HarmonicBalance, point: BranchPoint | None, peak: float, count: int) -> str:
    """Reason why a point does not belong to the branch; empty if it does."""
    if point is None:
        return "no periodic solution is found beyond it (possibly an internal resonance with another mode)"
    hertz, share = point.vibration.omega / (2 * np.pi), first_share(problem, point)
    if share < LEADING:
        return (
            f"the next solution, at {hertz:.4g} Hz, is another motion: its first harmonic has a share of {share:.2g} "
            f"(limit {LEADING:g})"
        )
    if point.vibration.amplitude < FALLEN * peak:
        return f"the branch turns back there, to {point.vibration.amplitude:.4g} m at {hertz:.4g} Hz"
    return f"it was followed over {POINTS} steps" if count >= POINTS else ""


def _ending_text(amplitude: float, vibration: Vibration, reason: str) -> str:
    last_text = (
        f"{vibration.amplitude:.4g} m at {vibration.omega / (2 * np.pi):.4g} Hz" if vibration.amplitude else "rest"
    )
    return (
        f"no free vibration with an amplitude of {amplitude:.4g} m was found; the branch was followed up to "
        f"{last_text}: {reason}. Request smaller amplitudes"
    )
