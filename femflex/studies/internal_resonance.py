"""Where a branch goes on beyond a tongue: internal resonance, by which it leads off into another mode's vibrations."""

from __future__ import annotations

import numpy as np

from femflex.studies.arc import Place, nearer, stepped
from femflex.studies.harmonic_balance import HarmonicBalance

LEADING = 0.5  # share that the first harmonic has in a motion of the branch
OWN = 0.95  # of the largest share before: places of less lie in the tongue already
SHORT, FARTHEST = 0.02, 2.0  # steps over a tongue along the arc
BACK = (1, 2, 3, 4, 6, 9, 13)  # the last places outside, from which they are tried
CLEAR = 2e-3  # of an amplitude by which a place beyond the tongue is greater: it does not lie in the tongue itself
LEAST = 5e-3  # of an amplitude: step in search of the far side


def beyond_resonance(problem: HarmonicBalance, places: list[Place], amplitude: float) -> Place | None:
    """The place of least amplitude beyond a tongue, or that of a requested amplitude; None where none is near.

    places: in order along the branch, up into the tongue or to its brink.
    """
    turn = int(np.argmax([place.at.amplitude for place in places]))
    peak = places[turn].at.amplitude
    shares = np.array([first_share(problem, place) for place in places[: turn + 1]])
    least = OWN * shares.max()
    outside = np.flatnonzero(shares > least)
    for place in (places[outside[-back]] for back in BACK if back <= len(outside)):
        rate = problem.rate(place.at, place.tangent)
        length = max(SHORT, (peak - place.at.amplitude) / rate) if rate > 0 else np.inf
        while length < FARTHEST:
            to = stepped(problem, place, length, np.inf)
            if to is not None and to.at.amplitude > (1 + CLEAR) * peak and first_share(problem, to) > least:
                return _nearest(problem, peak, to, amplitude)
            length *= 1.5
    return None


def first_share(problem: HarmonicBalance, place: Place) -> float:
    """Share of the first harmonic in the mean square of the motion about its mean, weighed by mass."""
    harmonics = place.at.harmonics
    n = harmonics.shape[1]
    squares = np.einsum("ki,ij,kj->k", harmonics[1:], problem.motion.mass[:n, :n], harmonics[1:])
    return float(squares[0] / squares.sum())


def _nearest(problem: HarmonicBalance, peak: float, far: Place, amplitude: float) -> Place:
    """From a place beyond a tongue down to its far side, or to a requested amplitude."""
    least = amplitude if peak < amplitude < far.at.amplitude else peak
    step = (far.at.amplitude - least) / 2
    while far.at.amplitude > least and step > LEAST * peak:
        lower = nearer(problem, far, max(least, far.at.amplitude - step))
        if lower is None:
            step /= 2
        else:
            far = lower
    return far
