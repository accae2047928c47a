"""Results of an integration: blocks of rows, the state to resume from, statistics, and the reason for its end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from femflex.arrays import Array
from femflex.integrate import resume as head
from femflex.integrate.step_monitor import MAX_TRIALS
from femflex.summary import Rows, Summarised

ROWS = 1024  # of a block, at most


@dataclass(frozen=True)
class Steps:
    """Step statistics of a run, counted over all its parts if it was resumed.

    accepted, rejected  steps; a rejected one failed its error test, its Newton iteration, or was not finite
    evaluations         calls of the rate (explicit) or of Newton's correction (implicit)
    smallest, largest   accepted step sizes [s]; inf and 0 before the first
    ended               "running", "finished", "stopped", "interrupted", or "failed: ..."
    """

    accepted: int
    rejected: int
    evaluations: int
    smallest: float
    largest: float
    ended: str = "running"

    @classmethod
    def from_resume(cls, resume: Array, ended: str = "running") -> Steps:
        """Statistics kept in the head of a resume array."""
        accepted, rejected, evaluations = (int(resume[i]) for i in (head.ACCEPTED, head.REJECTED, head.EVALUATIONS))
        return cls(
            accepted, rejected, evaluations, float(resume[head.SMALLEST]), float(resume[head.LARGEST]), ended=ended
        )


class Block(NamedTuple):
    """Rows of a trajectory in order, and the state to resume from after them.

    times   (n_rows,)      [s]; may be empty when a block's time ran out before the next output time
    states  (n_rows, n_x)
    resume  (n,)           the integrator's complete state, a plain array; hand it back as `state`
    """

    times: Array
    states: Array
    resume: Array

    @property
    def t(self) -> float:
        """Time reached by the steps [s], at or after the last row."""
        return float(self.resume[head.T])

    @property
    def x(self) -> Array:
        """State at that time (n_x,)."""
        return self.resume[head.HEAD : head.HEAD + int(self.resume[head.N_X])]

    @property
    def steps(self) -> Steps:
        """Statistics so far."""
        return Steps.from_resume(self.resume)


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Summarised):
    """A trajectory: times (n_t,), states (n_t, n_x), statistics, and the state to resume from."""

    times: Array
    states: Array
    steps: Steps
    resume: Array

    def summary(self) -> tuple[str, Rows]:
        """Its times and the number of states and steps."""
        rows = [("times", f"{len(self.times)} from {self.times[0]:g} to {self.times[-1]:g} s")]
        rows += [("states", str(self.states.shape[1]))]
        rows += [("steps", f"{self.steps.accepted} accepted, {self.steps.rejected} rejected; {self.steps.ended}")]
        return "Motion", rows


class IntegrationError(RuntimeError):
    """The integration failed; the exception carries the results so far, so that they can still be saved.

    times, states  the rows not yet handed out, ending with the last finite state (on no output time in general);
                   from `blocks` that is the last finite state alone, from `solve` the whole trajectory up to it
    coordinate     index in x of the first coordinate that was not finite, or else of the one with the largest error;
                   -1 where constraints cannot be satisfied
    steps          statistics
    reason         the message without who stopped and when; the message itself where it says neither
    """

    def __init__(
        self, message: str, times: Array, states: Array, coordinate: int, steps: Steps, reason: str = ""
    ) -> None:
        super().__init__(message)
        self.reason = reason or message
        self.times, self.states, self.coordinate, self.steps = times, states, coordinate, steps

    @property
    def t(self) -> float:
        """Time of the last finite state [s]."""
        return float(self.times[-1])


def failure(name: str, resume: Array, x: Array, model: object) -> IntegrationError:
    """The error that states why the steps of method `name` shrank to nothing; it carries the last finite state.

    A model may offer `diagnosis(t, x, infeasible)`: its own text on a state that no step leaves (infeasible: because
    the constraints contradict each other), and the exception that caused it, or "" and None.
    """
    t, coordinate = float(resume[head.T]), int(resume[head.COORDINATE])
    planned, largest = resume[head.H], resume[head.LARGEST]
    creeping = (
        f"with steps of {min(planned, largest or planned):.3g} s it would need more than {MAX_TRIALS:.0e} steps to the "
        f"end. A discontinuous force (dry friction, a hard contact) keeps the steps of coordinate {coordinate} short; "
        "smooth that force"
    )
    reason = {
        head.NOT_FINITE: f"the motion is not finite beyond this: coordinate {coordinate} is the first to fail",
        head.ERROR_TEST: f"no step is small enough to keep the error of coordinate {coordinate} within the tolerance",
        head.NEWTON: f"Newton's iteration does not converge, worst in coordinate {coordinate}",
        head.CREEPING: creeping,
        head.EVENT: "an event gives numbers that are not finite, or repeats without end at the same time",
        head.INFEASIBLE: "no state beyond this satisfies all constraints",
    }[int(resume[head.CAUSE])]
    diagnosis, source = getattr(model, "diagnosis", None), None
    if diagnosis is not None:
        diagnosis_text, source = diagnosis(t, x, int(resume[head.CAUSE]) == head.INFEASIBLE)
        reason = diagnosis_text or reason
    steps, text = (
        Steps.from_resume(resume, ended=f"failed: {reason}"),
        f"{reason}. The state at this time is the last one kept.",
    )
    message = f"{name} stopped at t = {t:.9g} s: {text}"
    error = IntegrationError(message, np.array([t]), x.copy()[None, :], coordinate, steps, text)
    error.__cause__ = source
    return error


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, or an interrupt raised by a progress callback, during `solve`; `solution` has the results so far."""

    def __init__(self, solution: Solution) -> None:
        super().__init__(f"interrupted at t = {solution.resume[head.T]:.6g} s; {len(solution.times)} rows are kept")
        self.solution = solution


def joined(blocks: list[Block], ended: str, n_x: int) -> Solution:
    """The solution made of consecutive blocks (at least one)."""
    times = np.concatenate([np.empty(0), *(block.times for block in blocks)])
    states = np.concatenate([np.empty((0, n_x)), *(block.states for block in blocks)])
    last = blocks[-1].resume
    return Solution(times, states, Steps.from_resume(last, ended), last)
