"""What a run will cost by a method, foretold from its first steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.integrate import resume as head
from femflex.integrate.driver import Adaptive
from femflex.integrate.intervals import interval
from femflex.integrate.protocol import Model

SETTLING, COUNTED = 60, 60  # trial steps in which the step size finds itself, and those that are counted


@dataclass(frozen=True)
class Forecast:
    """Calls of the model that a run will take, and the usual step [s]; both exact when the trial reached its end."""

    calls: float
    step: float


def forecast(method: Adaptive, model: Model, end: float, x0: Array) -> Forecast:
    """The cost of a run from x0 (n_x,) at t = 0 to `end` [s], if it goes on as its first steps do.

    The same on every machine, for it counts calls instead of seconds. Events are left out.
    """
    breaks = np.unique(np.asarray(model.breaks, float))
    resume = method.begin(model, np.array([0.0, end]), np.ascontiguousarray(x0, float), breaks)
    advance(method, model, resume, end, breaks, SETTLING)
    before = resume.copy()
    status = advance(method, model, resume, end, breaks, COUNTED)
    if resume[head.T] >= end:
        return Forecast(float(resume[head.EVALUATIONS]), end / max(1.0, float(resume[head.ACCEPTED])))
    calls, passed, steps = (float(resume[i] - before[i]) for i in (head.EVALUATIONS, head.T, head.ACCEPTED))
    if status == head.STUCK or not passed > 0.0:
        return Forecast(math.inf, 0.0)
    rest = (end - float(resume[head.T])) / passed
    return Forecast(float(resume[head.EVALUATIONS]) + calls * rest, passed / steps)


def advance(method: Adaptive, model: Model, resume: Array, end: float, breaks: Array, trials: int) -> int:
    """Take that many trial steps, or those up to the end; how the last call of the kernel ended."""
    fill, vectors = method.filler(model), resume[head.HEAD :].reshape(method.n_vectors, -1)
    last, status = resume[head.ACCEPTED] + resume[head.REJECTED] + trials, head.PAUSE
    while status in (head.PAUSE, head.END) and resume[head.T] < end:
        left = int(last - resume[head.ACCEPTED] - resume[head.REJECTED])
        if left <= 0:
            break
        span = interval(resume[head.T], end, breaks)
        status, _ = fill(resume, vectors, np.array([end]), np.empty((1, model.n_x)), span, left)
        if status == head.END and resume[head.T] < end:
            method.start_anew(model, resume, interval(resume[head.T], end, breaks))
    return int(status)
