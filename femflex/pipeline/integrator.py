"""The integrator of a run: selected or requested, with tolerances that fit the size of its coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from femflex.arrays import Array
from femflex.case.case import Case
from femflex.dynamics import Model
from femflex.dynamics.model import free_lengths
from femflex.integrate import INTEGRATORS, Dop853, Forecast, Integrator, choose, forecast, integrator
from femflex.integrate.driver import Adaptive
from femflex.noun.problems import CaseError, Problem

SETTINGS = ("rtol", "atol", "max_step", "step")


def case_integrator(case: Case, model: Model, times: Array, begun: str = "") -> tuple[Integrator, str]:
    """The integrator of a case's run over these times (n_t,) [s], and the sentence that gives the reason.

    begun: name of the integrator that a run to be resumed was begun with. Raises CaseError for settings that the method
    does not have.
    """
    table = case.run
    settings = {key: value for key in SETTINGS if (value := getattr(table, key)) is not None}
    try:
        return chosen_integrator(model, times, table.integrator, table.band, settings, begun)
    except SettingError as error:
        raise CaseError(case.path.name, [Problem(f"run.{error.key}", str(error))]) from None


class SettingError(ValueError):
    """A setting that an integrator does not have; key: its name."""

    def __init__(self, key: str, text: str) -> None:
        super().__init__(text)
        self.key = key


def chosen_integrator(
    model: Model,
    times: Array,
    requested: str = "auto",
    band: float | None = None,
    settings: Mapping[str, Any] | None = None,
    begun: str = "",
) -> tuple[Integrator, str]:
    """The integrator for output times (n_t,) [s], and the sentence that gives the reason.

    requested     name of an integrator, or "auto"
    band      highest frequency to resolve [Hz]; None: half the output frequency
    settings  of the integrator: rtol, atol, max_step [s], step [s]
    begun     name of the integrator that a run to be resumed was begun with

    Raises SettingError for a setting that the method does not have.
    """
    options, duration = dict(settings or {}), float(times[-1] - times[0])

    def trial(name: str) -> Forecast:
        rtol, most = options.get("rtol", Dop853.rtol), options.get("max_step", math.inf)
        method = integrator(name, rtol=rtol, atol=options.get("atol"), max_step=most)
        assert isinstance(method, Adaptive)  # as both of the automatic choice are
        return forecast(method, model, duration, model.x0)

    step, highest = float(times[1] - times[0]), model.max_frequency
    reason = "of the run so far" if begun else "requested"
    requested = begun or requested
    if requested == "auto" and (free := free_lengths(model.system)):
        requested, reason = "dop853", f"the length of {free[0]} is free"
    choice = choose(highest, duration, step, trial, None if band is None else 2.0 * math.pi * band, requested, reason)
    allowed = {field.name for field in fields(INTEGRATORS[choice.name])}  # type: ignore[arg-type]
    for key, value in options.items():
        if key not in allowed:
            text = f"found {value:g}, but {choice.name} has no {key}; leave it out, or select another integrator"
            raise SettingError(key, text)
    return integrator(choice.name, **options), choice.sentence
