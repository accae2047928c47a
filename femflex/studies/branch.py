"""The free vibrations of growing amplitude that one mode becomes, without the other periodic solutions.

Equations of harmonic balance have many solutions of an amplitude: other modes, and every motion once more as its own
k-th harmonic at 1/k of the frequency. The branch is therefore followed by the length of its arc (`arc`), in steps that
are halved until what is found continues it. Where a higher harmonic meets another mode the branch leads off into the
vibrations of that mode, in a tongue often so thin that steps pass it unseen; one that is met is stepped over, from
where the branch was still straight, and reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array
from femflex.studies.arc import Place, stepped
from femflex.studies.harmonic_balance import HarmonicBalance, Vibration
from femflex.studies.internal_resonance import LEADING, beyond_resonance, first_share

FIRST, LONGEST, SHORTEST = 0.1, 0.3, 1e-4  # steps along the arc
POINTS = 400  # of one branch
FALLEN = 0.5  # amplitude over the largest before at which the branch has turned for good


@dataclass
class Branch:
    """What was found of a branch.

    found   motions at the requested amplitudes, as far as there are
    points  all motions on the way, in order along the branch
    gaps    (from, to) amplitudes [m] between which a tongue was stepped over
    ended   why the branch was followed no further; nothing where all amplitudes were come to
    """

    found: list[Vibration] = field(default_factory=list)
    points: list[Vibration] = field(default_factory=list)
    gaps: list[tuple[float, float]] = field(default_factory=list)
    ended: str = ""


def followed(problem: HarmonicBalance, rest: Vibration, mode: Array, amplitudes: Sequence[float]) -> Branch:
    """The branch from rest on to rising amplitudes; mode (h, n) [kg^1/2] are the harmonics at rest per metre of
    amplitude."""
    branch = Branch()
    here = _begun(problem, rest, mode, float(amplitudes[0]))
    if here is None:
        branch.ended = _ended(float(amplitudes[0]), rest, "no periodic solution is found beyond it")
        return branch
    places, length = [here], FIRST
    for amplitude in map(float, amplitudes):
        wrong, length = _reach(problem, branch, places, amplitude, length)
        if wrong:
            branch.ended = _ended(amplitude, max((place.at for place in places), key=lambda at: at.amplitude), wrong)
            break
        if places[-1].at.amplitude == amplitude:
            branch.found.append(places[-1].at)
    branch.points = [place.at for place in places]
    return branch


def _begun(problem: HarmonicBalance, rest: Vibration, mode: Array, amplitude: float) -> Place | None:
    """A place so near to rest that the motion there is the mode's, at the amplitude or below."""
    row = np.append(mode.ravel(), 0.0)
    for _ in range(60):
        at = problem.balanced(Vibration(amplitude, rest.omega, amplitude * mode))
        if at is not None and at.omega > 0:
            change = float(np.linalg.norm(at.harmonics - amplitude * mode) / np.linalg.norm(at.harmonics))
            if max(change, abs(at.omega / rest.omega - 1)) < FIRST:
                return Place.of(problem, at, problem.tangent(at, row))
        amplitude /= 2
    return None


def _reach(
    problem: HarmonicBalance, branch: Branch, places: list[Place], amplitude: float, length: float
) -> tuple[str, float]:
    """Go on to an amplitude; what keeps from it (nothing, when come to or stepped over), and the step to go on with."""
    while places[-1].at.amplitude < amplitude:
        peak = max(place.at.amplitude for place in places)
        to = stepped(problem, places[-1], length, amplitude)
        wrong = _other(problem, to, peak, len(places))
        if to is None and length > SHORTEST:
            length /= 2
            continue
        if wrong:
            to, length = beyond_resonance(problem, places, amplitude), FIRST
            if to is None:
                return wrong, length
            branch.gaps.append((peak, to.at.amplitude))
        assert to is not None
        places.append(to)
        length = min(LONGEST, 1.5 * length)
    return "", length


def _other(problem: HarmonicBalance, to: Place | None, peak: float, count: int) -> str:
    """Why a place does not belong to the vibrations sought; nothing where it does."""
    if to is None:
        return "no periodic solution is found beyond it (possibly an internal resonance with another mode)"
    hertz, share = to.at.omega / (2 * np.pi), first_share(problem, to)
    if share < LEADING:
        return (
            f"the next solution, at {hertz:.4g} Hz, is another motion: its first harmonic has a share of {share:.2g} "
            f"(limit {LEADING:g})"
        )
    if to.at.amplitude < FALLEN * peak:
        return f"the branch turns back there, to {to.at.amplitude:.4g} m at {hertz:.4g} Hz"
    return f"it was followed over {POINTS} steps" if count >= POINTS else ""


def _ended(amplitude: float, at: Vibration, wrong: str) -> str:
    last = f"{at.amplitude:.4g} m at {at.omega / (2 * np.pi):.4g} Hz" if at.amplitude else "rest"
    return (
        f"no free vibration with an amplitude of {amplitude:.4g} m was found; the branch was followed up to {last}: "
        f"{wrong}. Request smaller amplitudes"
    )
