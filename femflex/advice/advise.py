"""Advice on a system and the duration of its run, for any system, with or without a case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.advice.advice import Advice, doubt, warn_of
from femflex.advice.bodies import BodyOrigins
from femflex.advice.buckling import buckling_margins, buckling_warnings, unassessed_bodies
from femflex.advice.curved import shape_notes
from femflex.advice.limits import division_remedy
from femflex.advice.model_warnings import model_warnings
from femflex.advice.motion_estimate import estimate_motion
from femflex.advice.strain import strain_advice
from femflex.advice.truncation import craft_modes, truncation_warnings
from femflex.reduction.origin import Origin
from femflex.system import System


def advise(
    system: System,
    duration: float,
    origins: Mapping[str, Origin] | None = None,
    *,
    fastest: ArrayLike | None = None,
    band: float = 0.0,
    warn: bool = True,
) -> tuple[Advice, ...]:
    """Advice on the strain forms and shapes of a system's bodies in a run of that duration [s], and physics warnings.

    It is based on a preliminary simulation with all bodies rigid and their small elastic response. Each Advice has the
    body, the decision, its reason, the computed value and its limit. Advice against the present form of a body (linear
    strain where spin, loads or deflections require another) is a doubt, issued as PhysicsWarning too unless `warn` is
    false.

    origins  origins of the bodies by name; with them buckling, curved shapes and truncation are assessed as well
    fastest  (3,) a steady spin at which the system is assessed too [rad/s]
    band     frequency up to which modes of the craft matter in addition to those that the run excites [Hz]
    """
    body_origins = BodyOrigins(origins or {})
    elastic = [name for name, body in system.bodies.items() if body.n_modes]
    linear = [name for name in elastic if system.bodies[name].strain_form == "linear"]
    estimate = estimate_motion(system, duration)
    margins = buckling_margins(estimate.rigid, system, body_origins)
    spin = None if fastest is None else np.asarray(fastest, float)
    strain_choices = strain_advice(system, linear, {}, estimate, body_origins, spin)
    advice = [strain_doubt(system, body_origins, choice) for name, choice in strain_choices.items()]
    advice += shape_notes(system.bodies, body_origins)
    advice += unassessed_bodies(system, body_origins, estimate.rigid, estimate.shortfall)
    advice += buckling_warnings(system, body_origins, margins)
    advice += truncation_warnings([craft_modes(system, body_origins, estimate.response)], band)
    advice += model_warnings(system, body_origins, duration)
    if warn:
        warn_of(advice)
    return tuple(advice)


def strain_doubt(system: System, origins: BodyOrigins, choice: Advice) -> Advice:
    """The advice on a body with linear strain as a physics warning, where another strain form is advised."""
    if choice.choice == "linear":
        return choice
    division = division_remedy(system.bodies[choice.body])
    remedy = f"{origins.remedy(choice.body)}, or {division}"
    text = f"body {choice.body!r} has linear strain: {choice.reason}. To follow it, {remedy}"
    return replace(doubt(choice.body, "strain", text, choice.value, choice.limit), choice=choice.choice)
