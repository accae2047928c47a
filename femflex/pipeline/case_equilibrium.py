"""Equilibrium and modes of the craft of a case, and the result file of an equilibrium."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.advice import advice_text, warn_of
from femflex.advice.watches import Watches

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.linear.equilibrium import Equilibrium
    from femflex.linear.system_modes import SystemModes
    from femflex.pipeline.decisions import ResolvedCase
    from femflex.system import Part


def resolve_at_rest(case: Case, bodies: Mapping[str, Part] | None = None) -> ResolvedCase:
    """The case with every automatic choice filled in, and without a start in equilibrium; issues physics warnings.

    bodies: instead of its own. Raises CaseError with all errors of the case.
    """
    from femflex.pipeline.decisions import resolve_choices

    if case.initial is not None and case.initial.source == "equilibrium":
        case = case.model_copy(update={"initial": None})  # the equilibrium is computed here
    resolved = resolve_choices(case, bodies)
    warn_of(resolved.advice)
    return resolved


def case_equilibrium(case: Case | ResolvedCase, at: float | None = None, stable: bool = False) -> Equilibrium:
    """The equilibrium of a case with its loads at a time [s]; stable: continue from an unstable one to a stable one.

    Issues the physics warnings about the bodies, and of deflections and axial forces beyond the limits of their strain.

    Raises CaseError and ValueError for a case that cannot be in equilibrium, EquilibriumError when none is found.
    """
    from femflex.linear.equilibrium import equilibrium

    resolved = _resolve_open_choices(case)
    state = equilibrium(resolved.system, at, stable)
    _warn(state, resolved, at)
    return state


def case_modes(
    case: Case | ResolvedCase, at: float | None = None, bodies: Mapping[str, Part] | None = None
) -> SystemModes:
    """The modes of the craft of a case about its equilibrium (`femflex.system_modes`), of these bodies where given.

    Warnings and errors as of `case_equilibrium`.
    """
    from femflex.linear.system_modes import system_modes

    resolved = _resolve_open_choices(case, bodies)
    modes = system_modes(resolved.system, at)
    _warn(modes.about, resolved, at)
    return modes


def _resolve_open_choices(case: Case | ResolvedCase, bodies: Mapping[str, Part] | None = None) -> ResolvedCase:
    from femflex.pipeline.decisions import ResolvedCase

    return case if isinstance(case, ResolvedCase) else resolve_at_rest(case, bodies)


def _warn(state: Equilibrium, resolved: ResolvedCase, at: float | None) -> None:
    """Warn of bodies with deflections or axial forces beyond the limits of their strain form."""
    watches = Watches(state.model, resolved.body_origins, resolved.notes, at_rest=True)
    channels = state.model.observe(np.zeros(1), state.x[None])
    watches.watch(np.array([at or 0.0]), state.x[None], channels)
    warn_of(watches.doubts())


def write_equilibrium(
    state: Equilibrium,
    case: Case,
    output: str | Path,
    *,
    force: bool = False,
    ended: str = "",
    resolved: ResolvedCase | None = None,
) -> None:
    """Write an equilibrium, or the last state before it failed, into a result file of one row at t = 0.

    ended: why no equilibrium was found; the file is then marked incomplete.
    """
    from femflex.pipeline.recovery_channels import recovery_channels
    from femflex.results import RunWriter

    model = state.model
    attributes = {
        "title": case.title,
        "case_text": case.text,
        "case_path": str(case.path),
        "without": "",
        "integrator": "equilibrium",
        "advice": advice_text(() if resolved is None else resolved.advice),
        "frame": f"N inertial; attitude from the {model.system.frame.kind} frame",
    }
    stresses, observed = recovery_channels(case, model.system), model.observe(np.zeros(1), state.x[None])
    channels = model.channels | stresses.channels
    with RunWriter(output, channels, model.system.bodies, attributes, rows=1, force=force) as writer:
        writer.write_block(np.zeros(1), observed | stresses.values(observed))
        verdict_text = ended or f"equilibrium, {state.verdict}"
        writer.finish(not ended, verdict_text, {"iterations": state.iterations, "residual": state.residual})
