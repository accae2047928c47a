"""Progress of the steps of a run, and the time that a block of rows takes.

A run that would need too many steps is stopped with the state reached. This happens with forces that jump with the
motion (dry friction, a hard contact): the steps then become tiny without failing.
"""

from __future__ import annotations

from time import perf_counter

from femflex.arrays import Array
from femflex.integrate import resume as head

TRIALS_BETWEEN_CHECKS = 1_000_000  # trial steps between two checks: ten seconds or more
BLOCK_SECONDS, MAX_BLOCK_SECONDS = 0.2, 1.0  # of a block, which a killed run may lose
BLOCK_TIME_RATIO = 5.0  # time of a block over the time that its consumer needs for it
MAX_TRIALS = 1e12  # trial steps for the rest of a smooth interval, above which a run is stopped: weeks at the least


class BlockTime:
    """Time limit of a block; it grows with the time that the consumer needs to observe and write one."""

    def __init__(self) -> None:
        self._consumer_time, self._handover = 0.0, 0.0

    def stop_at(self) -> float:
        """The instant [s] of perf_counter at which a block that begins now ends."""
        now = perf_counter()
        if self._handover > 0.0:
            self._consumer_time = now - self._handover
        return now + min(max(BLOCK_SECONDS, BLOCK_TIME_RATIO * self._consumer_time), MAX_BLOCK_SECONDS)

    def note_handover(self) -> None:
        """Note that a block is about to be handed over."""
        self._handover = perf_counter()


class StepMonitor:
    """Monitor of the time that the trial steps of a run advance it between two checks."""

    def __init__(self, resume: Array) -> None:
        self._trials, self._t = trials_of(resume), float(resume[head.T])

    def stalled(self, trials: int, t: float, end: float) -> bool:
        """Whether, at time t [s] after so many trials, the run to `end` [s] would take more than MAX_TRIALS."""
        since, gained = trials - self._trials, t - self._t
        if since < TRIALS_BETWEEN_CHECKS:
            return False
        self._trials, self._t = trials, t
        return (end - t) * since > MAX_TRIALS * gained


def trials_of(resume: Array) -> int:
    """Trial steps so far, accepted and rejected."""
    return int(resume[head.ACCEPTED] + resume[head.REJECTED])
