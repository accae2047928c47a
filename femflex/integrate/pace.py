"""Whether the steps get anywhere: a run that would never end is given up, with the state it has come to.

A force that jumps with the motion (dry friction, a hard contact) lets a method creep along with steps that are just
large enough to count, for longer than anybody waits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.integrate import resume as head

Array = NDArray[np.float64]

TRIALS = 1_000_000  # trial steps between two looks: ten seconds or more
MOST = 1e12  # trial steps for the rest of a smooth interval above which nobody waits for its end: weeks at the least


class Pace:
    """How far the trial steps of a run have brought it since it was last looked at."""

    def __init__(self, resume: Array) -> None:
        self._trials, self._t = trials_of(resume), float(resume[head.T])

    def hopeless(self, trials: int, t: float, end: float) -> bool:
        """Whether, at time t [s] after so many trials, the way to `end` [s] would take more than MOST of them."""
        since, gained = trials - self._trials, t - self._t
        if since < TRIALS:
            return False
        self._trials, self._t = trials, t
        return (end - t) * since > MOST * gained


def trials_of(resume: Array) -> int:
    """Trial steps so far, accepted and rejected."""
    return int(resume[head.ACCEPTED] + resume[head.REJECTED])
