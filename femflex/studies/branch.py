"""The free vibrations of growing amplitude that one mode becomes, and nothing else that balances beside them.

Equations of harmonic balance have many solutions of an amplitude: other modes, and every motion once more as its own
k-th harmonic at 1/k of the frequency. Steps of amplitude are therefore predicted along the tangent of the branch, and
halved until what is found lies near the prediction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femflex.studies.harmonic_balance import HarmonicBalance, Vibration

Array = NDArray[np.float64]
Slope = tuple[float, Array]  # of frequency and harmonics (h, n), by amplitude

NEAR = 0.1  # change of harmonics and of frequency against the prediction, in parts of their sizes
LEADING = 0.5  # share that the first harmonic has in a motion of the branch
SHORTEST = 1e-3  # step over the amplitude at which the branch counts as ended


def followed(
    problem: HarmonicBalance, rest: Vibration, slope: Slope, amplitudes: Sequence[float]
) -> tuple[list[Vibration], str]:
    """The motions at rising amplitudes, from rest on, and why there are no more of them (nothing if there are all).

    slope is that of the branch at rest: no change of frequency, and the mode per metre of amplitude.
    """
    found: list[Vibration] = []
    at, step = rest, float(amplitudes[0])
    for amplitude in map(float, amplitudes):
        while at.amplitude < amplitude:
            tried = min(amplitude, at.amplitude + step)
            if amplitude - tried < SHORTEST * amplitude:
                tried = amplitude
            to, wrong = _next(problem, at, slope, tried)
            if to is None:
                step = (tried - at.amplitude) / 2
                if step < SHORTEST * tried:
                    return found, _ended(amplitude, at, wrong)
                continue
            step = max(step, tried - at.amplitude) * (2 if tried < amplitude else 1)
            at, slope = to, problem.slope(to)
        found.append(at)
    return found, ""


def first_share(problem: HarmonicBalance, harmonics: Array) -> float:
    """Share of the first harmonic in the mean square of the motion about its mean, weighed by mass."""
    n = harmonics.shape[1]
    squares = np.einsum("ki,ij,kj->k", harmonics[1:], problem.motion.mass[:n, :n], harmonics[1:])
    return float(squares[0] / squares.sum())


def _next(problem: HarmonicBalance, at: Vibration, slope: Slope, amplitude: float) -> tuple[Vibration | None, str]:
    """The motion of a somewhat greater amplitude on the branch, or what is wrong with all that was found."""
    step = amplitude - at.amplitude
    start = Vibration(amplitude, at.omega + step * slope[0], at.harmonics + step * slope[1])
    to = problem.balanced(start) if start.omega > 0 else None
    if to is None:
        return None, "no motion balances a little beyond (as where a higher harmonic meets another mode)"
    share = first_share(problem, to.harmonics)
    if to.omega <= 0 or share < LEADING:
        return None, (
            f"what balances there, at {to.omega / (2 * np.pi):.4g} Hz, is another motion: its first harmonic has "
            f"{share:.2g} of it"
        )
    n = to.harmonics.shape[1]
    mass = problem.motion.mass[:n, :n]
    change = np.sqrt(_square(mass, to.harmonics - start.harmonics) / _square(mass, to.harmonics))
    turned = abs(to.omega - start.omega) / at.omega
    if max(change, turned) > NEAR:
        return None, (
            f"what balances there, at {to.omega / (2 * np.pi):.4g} Hz, does not continue it: its frequency is "
            f"{turned:.2g} and its motion {change:.2g} off what was to come"
        )
    return to, ""


def _square(mass: Array, harmonics: Array) -> float:
    return float(np.einsum("ki,ij,kj->", harmonics, mass, harmonics))


def _ended(amplitude: float, at: Vibration, wrong: str) -> str:
    where = f"near that of {at.amplitude:.4g} m, {at.omega / (2 * np.pi):.4g} Hz" if at.amplitude else "from rest on"
    return (
        f"no free vibration with an amplitude of {amplitude:.4g} m was found {where}, up to which the branch was "
        f"followed: {wrong}. Ask for amplitudes below that"
    )
