"""The integrator of a run: selected or requested, with tolerances that fit the size of its coordinates."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from femflex.arrays import Array
from femflex.case.case import Case
from femflex.case.problems import CaseError, Problem
from femflex.dynamics import Model
from femflex.dynamics.model import free_lengths
from femflex.integrate import INTEGRATORS, Dop853, Forecast, Integrator, choose, forecast, integrator
from femflex.integrate.driver import Adaptive


def chosen_integrator(case: Case, model: Model, times: Array, begun: str = "") -> tuple[Integrator, str]:
    """The integrator for the output times (n_t,) [s], and the sentence that gives the reason.

    Raises CaseError for settings that the method does not have.

    begun: name of the integrator that a run to be resumed was begun with.
    """
    table, duration = case.run, float(times[-1] - times[0])
    band = None if table.band is None else 2.0 * math.pi * table.band

    def trial(name: str) -> Forecast:
        method = integrator(name, rtol=table.rtol or Dop853.rtol, atol=table.atol, max_step=table.max_step or math.inf)
        assert isinstance(method, Adaptive)  # as both of the automatic choice are
        return forecast(method, model, duration, model.x0)

    step, highest = float(times[1] - times[0]), model.max_frequency
    why = "of the run so far" if begun else "requested"
    asked = begun or table.integrator
    if asked == "auto" and (free := free_lengths(model.system)):
        asked, why = "dop853", f"the length of {free[0]} is free"
    choice = choose(highest, duration, step, trial, band, asked, why)
    own = {field.name: field.default for field in fields(INTEGRATORS[choice.name])}  # type: ignore[arg-type]
    settings: dict[str, Any] = {}
    for key in ("rtol", "atol", "max_step", "step", "rho"):
        if (value := getattr(table, key)) is not None:
            settings[key] = value
            if key not in own:
                text = f"found {value:g}, but {choice.name} has no {key}; leave it out, or select another integrator"
                raise CaseError(case.path.name, [Problem(f"run.{key}", text)])
    return integrator(choice.name, **settings), choice.sentence
