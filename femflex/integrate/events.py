"""Events: instants at which the state jumps, found on the dense output of a step, after which the method starts anew.

A model with events is stepped one step at a time. Whether a run is stopped and resumed between two steps changes
nothing, for everything an event leaves behind is in the state x.

An event is looked for at the ends of the quarters of a step, and where its value turns back between two of them: there
its least value is found as the root of its rate, so that a graze counts that is as shallow as the polynomial of the
step is exact. What turns twice within a quarter of a step is not seen. Events that come within TOGETHER of a step of
each other happen as one.
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
from femflex.integrate.intervals import struck_next, until
from femflex.integrate.outcome import ROWS, Block, failure
from femflex.integrate.pace import BlockTime, Pace, trials_of

if TYPE_CHECKING:
    from femflex.integrate.driver import Adaptive, Fill
    from femflex.integrate.protocol import Clock, Model


TOGETHER = 1e-9  # of a step: what comes closer cannot be distinguished by its polynomial
SAMPLES = np.array([0.25, 0.5, 0.75, 1.0])  # of a step, at which its events are looked for


class Events(Protocol):
    """What a model says of its events."""

    def values(self, t: float, x: Array) -> Array:
        """(n,) one number per event: positive before it, and again once it has happened."""

    def rates(self, t: float, x: Array) -> Array:
        """(n,) rates of these numbers."""

    def happen(self, together: Sequence[int], t: float, x: Array) -> None:
        """Change x in place as these events do that happen at once."""


def eventful_blocks(method: Adaptive, model: Model, todo: Array, breaks: Array, resume: Array) -> Iterator[Block]:
    """Blocks of the states at the times `todo`, as `Adaptive.blocks` gives them, for a model with events."""
    stepper = Stepper(method, model, breaks, float(todo[-1]) if todo.size else 0.0, resume, method.filler(model))
    pace, spent = Pace(resume), BlockTime()
    while todo.size:
        rows: list[Array] = []
        kept, stuck = (0, resume.copy()), False
        stop_at = spent.stop_at()
        try:
            while len(rows) < min(ROWS, todo.size) and not stuck and perf_counter() < stop_at:
                stuck = stepper.advance(todo[len(rows) :], rows)
                if pace.hopeless(trials_of(resume), resume[head.T], stepper.end):
                    stuck, resume[head.CAUSE] = True, head.CREEPING
                kept = len(rows), resume.copy()
        except (KeyboardInterrupt, ValueError):  # the second of a controller whose answer is none
            yield block(todo, rows[: kept[0]], kept[1], model.n_x)
            raise
        spent.handed()
        yield block(todo, rows, kept[1], model.n_x)
        if stuck:
            raise failure(method.name, resume, stepper.vectors[0], model)
        todo = todo[len(rows) :]


def block(todo: Array, rows: list[Array], resume: Array, n_x: int) -> Block:
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
        found: Events = self.model.events  # type: ignore[attr-defined]
        return found

    @property
    def clock(self) -> Clock | None:
        """What changes the state at given instants, None where nothing does."""
        return getattr(self.model, "clock", None)

    @property
    def vectors(self) -> Array:
        """What the method keeps, the state first."""
        return self.resume[head.HEAD :].reshape(self.method.n_vectors, -1)

    def advance(self, todo: Array, rows: list[Array]) -> bool:
        """Take a step, or what stands at its beginning; append the rows it reaches. True when the method is stuck."""
        t, x, resume = float(self.resume[head.T]), self.vectors[0], self.resume
        due = np.flatnonzero(self.events.values(t, x) <= 0.0)
        if due.size:
            return not self.happen(due.tolist())
        if todo[0] <= t:
            rows.append(x.copy())
            resume[head.LAST_OUT] = todo[0]
            return False
        if self.clock is not None and self.clock.next(x) <= t:
            self.clock.strike(t, x)
            self.method.go_on(self.model, resume, self.interval(t))
            return False
        span = self.interval(t)
        last_out, taken = resume[head.LAST_OUT], resume[head.ACCEPTED]
        just_after = np.array([np.nextafter(t, math.inf)])  # a row inside the step makes it dense
        status, _ = self.fill(resume, self.vectors, just_after, np.empty((1, self.model.n_x)), span, 1)
        resume[head.LAST_OUT] = last_out
        if resume[head.ACCEPTED] > taken:
            if not self.finish(todo, rows):
                return True
        ended = resume[head.T] >= span[0] and resume[head.T] < self.end and resume[head.DENSE]
        if ended and not struck_next(self.clock, self.vectors[0], resume):
            self.start_anew()
        return bool(status == head.STUCK)

    def finish(self, todo: Array, rows: list[Array]) -> bool:
        """Append the rows of the step just taken, up to its first event, which then happens; False if that fails."""
        found = self.first_event()
        t = float(self.resume[head.T])
        for time in todo[todo <= t] if found is None else todo[todo < found[1]]:
            rows.append(self.state(float(time)))
            self.resume[head.LAST_OUT] = time
        if found is not None:
            h = t - float(self.resume[head.T_OLD])
            self.vectors[0] = self.state(found[1])
            self.resume[head.T] = found[1]
            return self.happen(self.together(found[0], h))
        return True

    def together(self, first: int, h: float) -> list[int]:
        """The events that happen with the first one, at the state reached by a step of size h."""
        t, x = float(self.resume[head.T]), self.vectors[0]
        ahead, rates = self.events.values(t, x), self.events.rates(t, x)
        return sorted({first, *np.flatnonzero((rates < 0.0) & (ahead <= -rates * TOGETHER * h)).tolist()})

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
            due += self.grazed(np.flatnonzero(falling & ~falls), [k for k, _ in due], before, after)
            if due:
                time, k = min((self.root(k, before, end), k) for k, end in due)
                return k, time
            before, falling = after, falls
        return None

    def grazed(self, turned: IntArray, due: list[int], a: float, b: float) -> list[tuple[int, float]]:
        """Of the events whose values turned back between a and b, those that were reached there, and by when."""
        lowest = [(int(k), self.root(int(k), a, b, of="rates")) for k in turned if k not in due]
        return [(k, time) for k, time in lowest if self.events.values(time, self.state(time))[k] <= 0.0]

    def root(self, k: int, a: float, b: float, of: str = "values") -> float:
        """The time between a and b at which the value of event k, or its rate, changes sign, to rounding."""
        from scipy.optimize import brentq

        sign = 1.0 if of == "values" else -1.0  # above zero before

        def value(time: float) -> float:
            return sign * float(getattr(self.events, of)(time, self.state(time))[k])

        if not value(a) > 0.0:
            return a
        return float(brentq(value, a, b, xtol=1e-15 * max(abs(b), 1e-300), rtol=4 * np.finfo(float).eps))

    def happen(self, together: list[int]) -> bool:
        """Let these events change the state, and start the method anew from there.

        False, with the state as it was, when they leave numbers that are not finite, or would happen again at once.
        """
        t, x = float(self.resume[head.T]), self.vectors[0].copy()
        self.events.happen(together, t, x)
        if not (np.isfinite(x).all() and np.all(self.events.values(t, x)[together] > 0.0)):
            self.resume[head.CAUSE], self.resume[head.COORDINATE] = head.EVENT, np.argmin(np.isfinite(x))
            return False
        self.vectors[0] = x
        self.start_anew()
        return True

    def start_anew(self) -> None:
        """Begin a smooth interval at the time reached."""
        self.method.start_anew(self.model, self.resume, self.interval(float(self.resume[head.T])))

    def interval(self, t: float) -> tuple[float, float, float]:
        """The smooth interval that holds t."""
        return until(self.clock, self.vectors[0], t, max(self.end, t), self.breaks)
