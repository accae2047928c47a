"""Forecast of the cost of a run by a method, from its first steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.integrate import resume as head
from femflex.integrate.driver import Adaptive
from femflex.integrate.intervals import interval
from femflex.integrate.protocol import Model

SETTLING, COUNTED = 60, 60  # trial steps in which the step size settles, and those that are counted


@dataclass(frozen=True)
class Forecast:
    """Calls of the model that a run will take, and the usual step [s]; both exact when the trial reached its end."""

    calls: float
    step: float


def forecast(method: Adaptive, model: Model, end: float, x0: Array) -> Forecast:
    """The cost of a run from x0 (n_x,) at t = 0 to `end` [s], extrapolated from its first steps.

    It is the same on every machine because it counts calls, not seconds. Events are ignored.
    """
    breaks = np.unique(np.asarray(model.breaks, float))
    resume = method.begin(model, np.array([0.0, end]), np.ascontiguousarray(x0, float), breaks)
    take_trials(method, model, resume, end, breaks, SETTLING)
    before = resume.copy()
    status = take_trials(method, model, resume, end, breaks, COUNTED)
    if resume[head.T] >= end:
        return Forecast(float(resume[head.EVALUATIONS]), end / max(1.0, float(resume[head.ACCEPTED])))
    calls, passed, steps = (float(resume[i] - before[i]) for i in (head.EVALUATIONS, head.T, head.ACCEPTED))
    if status == head.STUCK or not passed > 0.0:
        return Forecast(math.inf, 0.0)
    remaining = (end - float(resume[head.T])) / passed
    return Forecast(float(resume[head.EVALUATIONS]) + calls * remaining, passed / steps)


def take_trials(method: Adaptive, model: Model, resume: Array, end: float, breaks: Array, trials: int) -> int:
    """Take that many trial steps, or those up to the end; return the status of the last kernel call."""
    fill, vectors = method.filler(model), resume[head.HEAD :].reshape(method.n_vectors, -1)
    last_trial, status = resume[head.ACCEPTED] + resume[head.REJECTED] + trials, head.PAUSE
    while status in (head.PAUSE, head.END) and resume[head.T] < end:
        trials_left = int(last_trial - resume[head.ACCEPTED] - resume[head.REJECTED])
        if trials_left <= 0:
            break
        span = interval(resume[head.T], end, breaks)
        status, _ = fill(resume, vectors, np.array([end]), np.empty((1, model.n_x)), span, trials_left)
        if status == head.END and resume[head.T] < end:
            method.begin_interval(model, resume, interval(resume[head.T], end, breaks))
    return int(status)
