"""Events: instants at which the state jumps, located on the dense output of a step; the method then restarts.

A model with events is stepped one step at a time. Stopping and resuming a run between two steps changes nothing,
because all effects of an event are in the state x.

The value of each event is checked at the ends of the quarters of a step. Where its rate changes sign within a quarter,
its minimum is located as the root of the rate, so that grazing contacts count down to the accuracy of the step's
polynomial. Two sign changes within one quarter are missed. Events within SIMULTANEOUS of a step of each other are
applied together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Protocol

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.integrate import resume as head
from femflex.integrate.intervals import interval_until_sample, sample_due
from femflex.integrate.outcome import ROWS, Block, failure
from femflex.integrate.step_monitor import BlockTime, StepMonitor, trials_of

if TYPE_CHECKING:
    from femflex.integrate.driver import Adaptive, Fill
    from femflex.integrate.protocol import Clock, Model


SIMULTANEOUS = 1e-9  # of a step: what comes closer cannot be distinguished by its polynomial
SAMPLES = np.array([0.25, 0.5, 0.75, 1.0])  # of a step, at which its events are looked for


class Events(Protocol):
    """Values and rates of a model's events, and their effect on the state."""

    def values(self, t: float, x: Array) -> Array:
        """(n,) one number per event: positive before it, and again once it has happened."""

    def rates(self, t: float, x: Array) -> Array:
        """(n,) rates of these numbers."""

    def apply(self, simultaneous: Sequence[int], t: float, x: Array) -> None:
        """Change x in place by these simultaneous events."""


def blocks_with_events(method: Adaptive, model: Model, todo: Array, breaks: Array, resume: Array) -> Iterator[Block]:
    """Blocks of the states at the times `todo`, as `Adaptive.blocks` gives them, for a model with events."""
    stepper = Stepper(method, model, breaks, float(todo[-1]) if todo.size else 0.0, resume, method.filler(model))
    monitor, block_time = StepMonitor(resume), BlockTime()
    while todo.size:
        rows: list[Array] = []
        consistent, stuck = (0, resume.copy()), False
        stop_at = block_time.stop_at()
        try:
            while len(rows) < min(ROWS, todo.size) and not stuck and perf_counter() < stop_at:
                stuck = stepper.advance(todo[len(rows) :], rows)
                if monitor.stalled(trials_of(resume), resume[head.T], stepper.end):
                    stuck, resume[head.CAUSE] = True, head.CREEPING
                consistent = len(rows), resume.copy()
        except (KeyboardInterrupt, ValueError):  # the second of a controller whose answer is none
            yield block_of_rows(todo, rows[: consistent[0]], consistent[1], model.n_x)
            raise
        block_time.note_handover()
        yield block_of_rows(todo, rows, consistent[1], model.n_x)
        if stuck:
            raise failure(method.name, resume, stepper.vectors[0], model)
        todo = todo[len(rows) :]


def block_of_rows(todo: Array, rows: list[Array], resume: Array, n_x: int) -> Block:
    """The block of these rows."""
    return Block(todo[: len(rows)], np.array(rows).reshape(len(rows), n_x), resume)


@dataclass(frozen=True, eq=False)
class Stepper:
    """Single steps of a method over a model with events, to the time `end`, with its memory in `resume`."""

    method: Adaptive
    model: Model
    breaks: Array
    end: float
    resume: Array
    fill: Fill

    @property
    def events(self) -> Events:
        """The model's events."""
        events: Events = self.model.events  # type: ignore[attr-defined]
        return events

    @property
    def clock(self) -> Clock | None:
        """The model's clock of sampled controllers, or None."""
        return getattr(self.model, "clock", None)

    @property
    def vectors(self) -> Array:
        """The method's vectors, the state first."""
        return self.resume[head.HEAD :].reshape(self.method.n_vectors, -1)

    def advance(self, todo: Array, rows: list[Array]) -> bool:
        """Take a step, or apply an event, row or sample due at its beginning; append its rows. True if stuck."""
        t, x, resume = float(self.resume[head.T]), self.vectors[0], self.resume
        due = np.flatnonzero(self.events.values(t, x) <= 0.0)
        if due.size:
            return not self.apply_events(due.tolist())
        if todo[0] <= t:
            rows.append(x.copy())
            resume[head.LAST_OUT] = todo[0]
            return False
        if self.clock is not None and self.clock.next_instant(x) <= t:
            self.clock.sample(t, x)
            self.method.restart_after_sample(self.model, resume, self.interval(t))
            return False
        span = self.interval(t)
        last_out, accepted_before = resume[head.LAST_OUT], resume[head.ACCEPTED]
        just_after = np.array([np.nextafter(t, math.inf)])  # a row inside the step makes it dense
        status, _ = self.fill(resume, self.vectors, just_after, np.empty((1, self.model.n_x)), span, 1)
        resume[head.LAST_OUT] = last_out
        if resume[head.ACCEPTED] > accepted_before:
            if not self.finish_step(todo, rows):
                return True
        ended = resume[head.T] >= span[0] and resume[head.T] < self.end and resume[head.DENSE]
        if ended and not sample_due(self.clock, self.vectors[0], resume):
            self.begin_interval()
        return bool(status == head.STUCK)

    def finish_step(self, todo: Array, rows: list[Array]) -> bool:
        """Append the rows of the last step up to its first event, and apply that event; False if this fails."""
        event = self.first_event()
        t = float(self.resume[head.T])
        for time in todo[todo <= t] if event is None else todo[todo < event[1]]:
            rows.append(self.state(float(time)))
            self.resume[head.LAST_OUT] = time
        if event is not None:
            h = t - float(self.resume[head.T_OLD])
            self.vectors[0] = self.state(event[1])
            self.resume[head.T] = event[1]
            return self.apply_events(self.simultaneous_events(event[0], h))
        return True

    def simultaneous_events(self, first: int, h: float) -> list[int]:
        """The events to apply together with the first one, at the state reached by a step of size h."""
        t, x = float(self.resume[head.T]), self.vectors[0]
        ahead, rates = self.events.values(t, x), self.events.rates(t, x)
        return sorted({first, *np.flatnonzero((rates < 0.0) & (ahead <= -rates * SIMULTANEOUS * h)).tolist()})

    def state(self, time: float) -> Array:
        """The state at a time within the last step."""
        t_old, t = float(self.resume[head.T_OLD]), float(self.resume[head.T])
        if time >= t:
            return self.vectors[0].copy()
        x = self.method.dense((time - t_old) / (t - t_old), t - t_old, self.vectors)
        for first in self.model.renormalise:
            x[first : first + 4] /= math.sqrt(sum(float(e) ** 2 for e in x[first : first + 4]))
        project = getattr(self.model, "project", None)
        if project is not None:
            project(time, x, self.model.table, self.model.pool, self.model.work)
        return x

    def first_event(self) -> tuple[int, float] | None:
        """Number and time of the first event of the last step, or None."""
        t_old, t = float(self.resume[head.T_OLD]), float(self.resume[head.T])
        before, falling = t_old, self.events.rates(t_old, self.state(t_old)) < 0.0
        for part in SAMPLES:
            after = t if part == 1.0 else t_old + part * (t - t_old)
            x = self.state(after)
            due = [(int(k), after) for k in np.flatnonzero(self.events.values(after, x) <= 0.0)]
            falls = self.events.rates(after, x) < 0.0
            due += self.grazing_events(np.flatnonzero(falling & ~falls), [k for k, _ in due], before, after)
            if due:
                time, k = min((self.root(k, before, end), k) for k, end in due)
                return k, time
            before, falling = after, falls
        return None

    def grazing_events(self, turning: IntArray, due: list[int], a: float, b: float) -> list[tuple[int, float]]:
        """Events whose values have a minimum at or below zero between a and b, and the times of these minima."""
        lowest = [(int(k), self.root(int(k), a, b, quantity="rates")) for k in turning if k not in due]
        return [(k, time) for k, time in lowest if self.events.values(time, self.state(time))[k] <= 0.0]

    def root(self, k: int, a: float, b: float, quantity: str = "values") -> float:
        """The time between a and b at which the value of event k, or its rate, changes sign, to rounding."""
        from scipy.optimize import brentq

        sign = 1.0 if quantity == "values" else -1.0  # above zero before

        def value(time: float) -> float:
            return sign * float(getattr(self.events, quantity)(time, self.state(time))[k])

        if not value(a) > 0.0:
            return a
        return float(brentq(value, a, b, xtol=1e-15 * max(abs(b), 1e-300), rtol=4 * np.finfo(float).eps))

    def apply_events(self, simultaneous: list[int]) -> bool:
        """Apply these events to the state, and restart the method from there.

        Returns False, and leaves the state unchanged, if the result is not finite or an event would repeat at once.
        """
        t, x = float(self.resume[head.T]), self.vectors[0].copy()
        self.events.apply(simultaneous, t, x)
        if not (np.isfinite(x).all() and np.all(self.events.values(t, x)[simultaneous] > 0.0)):
            self.resume[head.CAUSE], self.resume[head.COORDINATE] = head.EVENT, np.argmin(np.isfinite(x))
            return False
        self.vectors[0] = x
        self.begin_interval()
        return True

    def begin_interval(self) -> None:
        """Begin a smooth interval at the time reached."""
        self.method.begin_interval(self.model, self.resume, self.interval(float(self.resume[head.T])))

    def interval(self, t: float) -> tuple[float, float, float]:
        """The smooth interval that holds t."""
        return interval_until_sample(self.clock, self.vectors[0], t, max(self.end, t), self.breaks)
