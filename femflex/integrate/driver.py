"""The loop around a compiled method: smooth intervals, blocks of rows, bounded kernel calls, failure and interruption.

A kernel is called for about 0.1 s at a time, so that Ctrl-C, progress and writing are served between two calls. Where
the calls end never changes a step: the resume array holds the complete state of the method.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.integrate import resume as head
from femflex.integrate.events import blocks_with_events
from femflex.integrate.intervals import Span, interval, interval_until_sample, sample_due
from femflex.integrate.outcome import ROWS, Block, IntegrationError, Interrupted, Solution, failure, joined
from femflex.integrate.protocol import Model, Progress
from femflex.integrate.step_monitor import BlockTime, StepMonitor, trials_of

Fill = Callable[[Array, Array, Array, Array, Span, int], tuple[int, int]]  # state, vectors, times, rows, span, budget

ABSOLUTE = 0.1  # absolute over relative tolerance, times the size of the motion
CALL_SECONDS = 0.1
FIRST_BUDGET = 8  # trial steps of the first kernel call, before their cost is known


@dataclass(frozen=True, eq=False)
class Adaptive(ABC):
    """Settings common to the adaptive methods, and the driver they share.

    rtol      relative tolerance of a step's error [1]
    atol      absolute tolerance, one number or (n_x,), in the units of x. None: ABSOLUTE times rtol times the size of
              the motion, which the model states (`motion_scales`; 1 for one that does not)
    max_step  largest step [s]
    """

    rtol: float = 1e-9
    atol: float | Array | None = None
    max_step: float = math.inf

    name: ClassVar[str]
    order: ClassVar[int]
    number: ClassVar[int]  # of the method, written into its resume arrays
    n_vectors: ClassVar[int]  # the state first, the absolute tolerances last

    def __post_init__(self) -> None:
        absolute = self.rtol if self.atol is None else self.atol
        if not self.rtol >= 0.0 or not np.all(np.asarray(absolute, float) > 0.0):
            raise ValueError(
                f"tolerances: rtol = {self.rtol} must not be negative, atol = {self.atol} be positive; without atol, "
                "give a positive rtol."
            )
        if not self.max_step > 0.0:
            raise ValueError(f"max_step = {self.max_step} must be positive.")

    @abstractmethod
    def restart(self, model: Model, vectors: Array, t: float, span: Span) -> tuple[float, int]:
        """First step of a smooth interval and the number of model calls spent; sets the method's vectors except x."""

    @abstractmethod
    def filler(self, model: Model) -> Fill:
        """The compiled loop, bound to the model, this method's settings and scratch of its own."""

    @abstractmethod
    def dense(self, theta: float, h: float, vectors: Array) -> Array:
        """The state (n_x,) at the fraction theta of the last step of size h, by the method's interpolant."""

    def absolute(self, model: Model, times: Array, x0: Array) -> Array:
        """Absolute tolerances (n_x,) of a run over `times` (n_t,) [s] from x0 (n_x,)."""
        if self.atol is not None:
            return np.broadcast_to(np.asarray(self.atol, float), (model.n_x,)).copy()
        scales = getattr(model, "motion_scales", None)
        sizes = np.ones(model.n_x) if scales is None else scales(x0, float(times[0]), float(times[-1]))
        return np.asarray(ABSOLUTE * self.rtol * sizes)

    def blocks(self, model: Model, times: Array, x0: Array, state: Array | None = None) -> Iterator[Block]:
        """Blocks of the states at `times` (n_t,), ascending [s]; x0 (n_x,) is the state at times[0].

        With `state` (the `resume` of an earlier block, of a run over the same times) the run continues from there and
        x0 is not used; `times` may or may not include those of earlier blocks. The rows are those of an uninterrupted
        run, bit for bit. On Ctrl-C the rows so far come as one last block before KeyboardInterrupt is raised.
        """
        times, x0 = checked(times, x0, model.n_x)
        breaks = np.unique(np.asarray(model.breaks, float))
        resume = self.begin(model, times, x0, breaks) if state is None else self._resumed(model, times, state)
        return self._blocks(model, times[times > resume[head.LAST_OUT]], breaks, resume)

    def solve(
        self, model: Model, times: Array, x0: Array, progress: Progress | None = None, state: Array | None = None
    ) -> Solution:
        """All states at `times`; `progress(t)` is called after each block, and a true answer from it stops the run.

        Raises IntegrationError, or Interrupted on Ctrl-C; both carry what was computed.
        """
        return collected(self.blocks(model, times, x0, state), progress, model.n_x)

    def begin(self, model: Model, times: Array, x0: Array, breaks: Array) -> Array:
        """The resume array of a run over `times` that is about to begin at x0 (n_x,)."""
        resume = np.zeros(head.HEAD + self.n_vectors * model.n_x)
        resume[head.METHOD], resume[head.N_X] = self.number, model.n_x
        resume[head.T], resume[head.T_OLD], resume[head.LAST_OUT] = times[0], times[0], -math.inf
        resume[head.ERROR], resume[head.SMALLEST] = 1e-4, math.inf
        vectors = resume[head.HEAD :].reshape(self.n_vectors, -1)
        vectors[0], vectors[-1] = x0, self.absolute(model, times, x0)
        self.begin_interval(model, resume, interval(times[0], times[-1], breaks))
        return resume

    def begin_interval(self, model: Model, resume: Array, span: Span) -> None:
        """Begin a smooth interval at the time and state in `resume`."""
        vectors = resume[head.HEAD :].reshape(self.n_vectors, -1)
        h, calls = self.restart(model, vectors, resume[head.T], span)
        resume[head.H], resume[head.ERROR], resume[head.REJECTED_LAST] = min(h, self.max_step), 1e-4, 0.0
        resume[head.CONTRACTION] = 0.5
        resume[head.T_OLD], resume[head.DENSE] = resume[head.T], 0.0  # no step before this one
        resume[head.EVALUATIONS] += calls

    def restart_after_sample(self, model: Model, resume: Array, span: Span) -> None:
        """Begin a smooth interval after a sample, with a first step no longer than the next step would have been.

        Samples change the motion little, and the automatic first step is mostly too long: this saves up to five trials.
        """
        due, has_steps = float(resume[head.H]), resume[head.ACCEPTED] > 0
        self.begin_interval(model, resume, span)
        if has_steps and due > 0.0:
            resume[head.H] = min(resume[head.H], due)

    def _resumed(self, model: Model, times: Array, state: Array) -> Array:
        resume = np.array(state, float)
        expected = (float(self.number), float(model.n_x), head.HEAD + self.n_vectors * model.n_x)
        if resume.size < head.HEAD or (resume[head.METHOD], resume[head.N_X], resume.size) != expected:
            raise ValueError(
                f"the stored state ({resume.size} numbers) was not written by {self.name!r} for {model.n_x} states. "
                "Resume with the method and the model of the first part, or start anew."
            )
        bad = ~np.isfinite(resume[[head.T, head.H, *range(head.HEAD, head.HEAD + model.n_x)]])
        if bad.any():
            raise ValueError(
                f"the stored state is damaged: {int(bad.sum())} of its numbers are not finite. Start anew, or resume "
                "from another file."
            )
        ahead = times[times > resume[head.LAST_OUT]]
        if ahead.size and ahead[0] < resume[head.T] and resume[head.DENSE] == 0.0:
            raise ValueError(
                f"the stored state can give no rows before t = {resume[head.T]:.9g} s, but the first requested time is "
                f"{ahead[0]:.9g} s. Resume with the output times of the first part."
            )
        return resume

    def _blocks(self, model: Model, todo: Array, breaks: Array, resume: Array) -> Iterator[Block]:
        if getattr(model, "events", None) is not None:
            yield from blocks_with_events(self, model, todo, breaks, resume)
            return
        fill, budget, monitor, clock = (
            self.filler(model),
            FIRST_BUDGET,
            StepMonitor(resume),
            getattr(model, "clock", None),
        )
        block_time = BlockTime()
        vectors = resume[head.HEAD :].reshape(self.n_vectors, -1)
        while todo.size:
            rows = np.empty((min(ROWS, todo.size), model.n_x))
            consistent, status = (0, resume.copy()), head.PAUSE  # rows and resume array if a call is interrupted
            stop_at = block_time.stop_at()
            try:
                while consistent[0] < len(rows) and status != head.STUCK and perf_counter() < stop_at:
                    due = clock is not None and clock.next_instant(vectors[0]) <= resume[head.T]
                    if (
                        clock is not None and due and todo[consistent[0]] > resume[head.T]
                    ):  # all rows up to here are out
                        clock.sample(float(resume[head.T]), vectors[0])
                        self.restart_after_sample(
                            model, resume, interval_until_sample(clock, vectors[0], resume[head.T], todo[-1], breaks)
                        )
                    span = interval_until_sample(clock, vectors[0], resume[head.T], todo[-1], breaks)
                    count, called = consistent[0], perf_counter()
                    status, written = fill(resume, vectors, todo[count:], rows[count:], span, budget)
                    if status == head.PAUSE:
                        budget = adapted(budget, perf_counter() - called)
                    elif status == head.END and not due and not sample_due(clock, vectors[0], resume):
                        self.begin_interval(
                            model, resume, interval_until_sample(clock, vectors[0], resume[head.T], todo[-1], breaks)
                        )
                    if monitor.stalled(trials_of(resume), resume[head.T], span[0]):
                        status, resume[head.CAUSE] = head.STUCK, head.CREEPING
                    consistent = count + written, resume.copy()
            except (KeyboardInterrupt, ValueError):  # the second of a controller whose answer is none
                yield Block(todo[: consistent[0]], rows[: consistent[0]], consistent[1])
                raise
            block_time.note_handover()
            yield Block(todo[: consistent[0]], rows[: consistent[0]], consistent[1])
            if status == head.STUCK:
                raise failure(self.name, resume, vectors[0], model)
            todo = todo[consistent[0] :]


def adapted(budget: int, seconds: float) -> int:
    """Trial steps for the next kernel call, so that it takes about CALL_SECONDS."""
    return max(1, int(budget * min(8.0, CALL_SECONDS / max(seconds, 1e-9))))


def checked(times: Array, x0: Array, n_x: int) -> tuple[Array, Array]:
    """Return output times and first state as contiguous arrays; raise ValueError that names the fault in them."""
    times, x0 = np.ascontiguousarray(times, float), np.ascontiguousarray(x0, float)
    if times.ndim != 1 or times.size == 0 or not np.all(np.isfinite(times)) or not np.all(np.diff(times) > 0.0):
        raise ValueError("output times must be a list of at least one finite number, strictly ascending.")
    if x0.shape != (n_x,):
        raise ValueError(f"the first state has shape {x0.shape}; the model has {n_x} states.")
    if not np.all(np.isfinite(x0)):
        bad = int(np.argmin(np.isfinite(x0)))
        raise ValueError(f"the first state is not finite: coordinate {bad} is {x0[bad]}.")
    return times, x0


def collected(blocks: Iterator[Block], progress: Progress | None, n_x: int) -> Solution:
    """The blocks of a run in one Solution; errors and interrupts carry the rows collected before them."""
    collected_blocks: list[Block] = []
    try:
        for block in blocks:
            collected_blocks.append(block)
            if progress is not None and progress(block.t):
                return joined(collected_blocks, "stopped", n_x)
    except IntegrationError as error:
        before = joined(collected_blocks, error.steps.ended, n_x)
        new = slice(1, None) if before.times.size and before.times[-1] == error.t else slice(None)
        error.states = np.concatenate([before.states, error.states[new]])
        error.times = np.concatenate([before.times, error.times[new]])
        raise
    except KeyboardInterrupt as stop:
        if not collected_blocks:
            raise
        raise Interrupted(joined(collected_blocks, "interrupted", n_x)) from stop
    return joined(collected_blocks, "finished", n_x)
