"""The automatic choice between the explicit and the implicit method, with the numbers it rests on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.integrate import resume as head
from femflex.integrate.driver import Adaptive
from femflex.integrate.intervals import interval
from femflex.integrate.protocol import Model

EXPLICIT, IMPLICIT = "dop853", "esdirk4"
KINDS = {EXPLICIT: "explicit, order 8", IMPLICIT: "implicit, order 4"}
STABLE_PHASE = 5.5  # omega h up to which dop853 is stable on the imaginary axis (it ends at 5.9)
RESOLVED_PHASE = 0.3  # omega h at which dop853 follows a mode to about 1e-11 a step
ACCURACY_RATIO = 3.0  # steps shorter than the stable ones by more than this are limited by accuracy
STEP_RATES = 12  # of dop853
CORRECTION_RATES = 2.0  # cost of Newton's correction and its kinematics; measured 0.7 (long chains) to 3 (few bodies)
FEWEST_EVALUATIONS = 1e5  # explicit rates, about half a second of work, below which nothing is gained by a trial

Trial = Callable[[str], "Forecast"]  # name of a method -> what the run costs by it
SETTLING, COUNTED = 60, 60  # trial steps in which the step size settles, and those that are counted


@dataclass(frozen=True)
class Choice:
    """A chosen integrator: its name in the register, and a sentence for the screen with the numbers behind it."""

    name: str
    sentence: str


def choose(
    highest: float,
    duration: float,
    output_step: float,
    trial: Trial,
    band: float | None = None,
    requested: str = "auto",
    reason: str = "requested",
) -> Choice:
    """The integration method for a run, or the `requested` one, with a sentence that gives the reason.

    highest      highest frequency of small motions of the whole system [rad/s]; 0 for rigid systems
    duration     of the run [s]
    output_step  between output times [s]
    trial        predicts the cost by a method at the tolerance of the explicit one; called only where it decides
    reason       why the requested method is used, in words
    band         highest frequency of interest [rad/s]; by default what the output can show, pi / output_step

    The implicit method is chosen when modes lie above the band and it costs less at the same tolerance. Its cost
    depends on whether these modes are excited, not on their frequency, so it is measured by a trial. Where the steps of
    the explicit method are far below its stability limit, accuracy limits them. A method of lower order would take even
    shorter steps there and is not tried.
    """
    if requested != "auto":
        return Choice(requested, f"{requested} ({reason}): {_frequencies(highest, output_step, band)}.")
    highest_needed = math.pi / output_step if band is None else band
    text = _frequencies(highest, output_step, band)
    if highest <= highest_needed:
        return Choice(EXPLICIT, f"{EXPLICIT} ({KINDS[EXPLICIT]}): {text}.")
    most_evaluations = STEP_RATES * duration * highest / RESOLVED_PHASE
    if most_evaluations < FEWEST_EVALUATIONS:
        return Choice(
            EXPLICIT,
            f"{EXPLICIT} ({KINDS[EXPLICIT]}): {text}; at most {most_evaluations:.1e} evaluations for {duration:.4g} s.",
        )
    explicit_forecast, stable = trial(EXPLICIT), STABLE_PHASE / highest
    if 0.0 < explicit_forecast.step < stable / ACCURACY_RATIO:
        return Choice(
            EXPLICIT,
            f"{EXPLICIT} ({KINDS[EXPLICIT]}): {text}. Accuracy limits its steps to {explicit_forecast.step:.2g} s, "
            f"stability to {stable:.2g} s; the implicit method has the lower order and would take shorter ones.",
        )
    implicit_forecast = trial(IMPLICIT)
    explicit, implicit = (
        max(explicit_forecast.calls, STEP_RATES * duration / stable),
        CORRECTION_RATES * implicit_forecast.calls,
    )
    name = IMPLICIT if implicit < explicit else EXPLICIT
    steps = min(explicit_forecast.step, stable), implicit_forecast.step
    return Choice(
        name,
        f"{name} ({KINDS[name]}): {text}. Estimated evaluations for {duration:.4g} s at equal tolerance: "
        f"explicit {explicit:.1e} (steps of {steps[0]:.2g} s), implicit {implicit:.1e} (steps of {steps[1]:.2g} s).",
    )


def _frequencies(highest: float, output_step: float, band: float | None) -> str:
    if highest == 0.0:
        return "the model has no elastic or spring modes"
    highest_needed, source = (math.pi / output_step, "in the output") if band is None else (band, "wanted")
    return (
        f"the highest natural frequency is {highest / (2 * math.pi):.4g} Hz, the highest {source} "
        f"{highest_needed / (2 * math.pi):.4g} Hz"
    )


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
