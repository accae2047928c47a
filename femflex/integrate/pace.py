"""Whether the steps get anywhere: a run that would never end is given up, with the state it has come to.

A force that jumps with the motion (dry friction, a hard contact) lets a method creep along with steps that are just
large enough to count, for longer than anybody waits.
"""

from __future__ import annotations

from time import perf_counter

from femflex.arrays import Array
from femflex.integrate import resume as head

TRIALS = 1_000_000  # trial steps between two looks: ten seconds or more
BLOCK_SECONDS, MOST_SECONDS = 0.2, 1.0  # of a block, which a killed run may lose
FOLD = 5.0  # times the time that a block's taker needs
MOST = 1e12  # trial steps for the rest of a smooth interval above which nobody waits for its end: weeks at the least


class BlockTime:
    """How long a block may take: longer where whoever takes it (who observes it and writes it) needs long for each."""

    def __init__(self) -> None:
        self._taken, self._handed = 0.0, 0.0

    def stop_at(self) -> float:
        """The instant [s] of perf_counter at which a block that begins now ends."""
        now = perf_counter()
        if self._handed > 0.0:
            self._taken = now - self._handed
        return now + min(max(BLOCK_SECONDS, FOLD * self._taken), MOST_SECONDS)

    def handed(self) -> None:
        """A block is about to be handed over."""
        self._handed = perf_counter()


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
