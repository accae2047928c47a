"""From a case to its equilibrium, and that into a result file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.advice import advice_text, warn_of
from femflex.advice.deflections import deflection_watches
from femflex.advice.deployed_bending import AxialForceWatch
from femflex.advice.spun_bends import SpunBends
from femflex.advice.stiffening import StiffeningWatch

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.dynamics.equilibria.equilibrium import Equilibrium
    from femflex.dynamics.equilibria.system_modes import SystemModes
    from femflex.pipeline.decisions import Decided
    from femflex.system import Part


def decided_at_rest(case: Case, bodies: Mapping[str, Part] | None = None) -> Decided:
    """The case with all choices made, not started in the equilibrium that is to be found; its doubts as warnings.

    bodies: instead of its own. Raises CaseError for what does not fit together.
    """
    from femflex.pipeline.decisions import decided

    if case.initial is not None and case.initial.source == "equilibrium":
        case = case.model_copy(update={"initial": None})  # it is what is sought here
    found = decided(case, bodies)
    warn_of(found.advice)
    return found


def balanced(case: Case | Decided, at: float | None = None, stable: bool = False) -> Equilibrium:
    """The equilibrium of a case, with its loads as at a time [s]; stable: an unstable one is left for one that is.

    Warns of what is doubtful of its bodies, and of those that are bent, or pulled or pressed along, by more than their
    strain is good for.

    Raises CaseError and ValueError for what cannot be in equilibrium, EquilibriumError when none is found.
    """
    from femflex.dynamics.equilibria.equilibrium import equilibrium

    decided = _decided(case)
    found = equilibrium(decided.system, at, stable)
    _warn(found, decided, at)
    return found


def case_modes(case: Case | Decided, at: float | None = None, bodies: Mapping[str, Part] | None = None) -> SystemModes:
    """The modes of the craft of a case about its equilibrium (`femflex.system_modes`), of these bodies where given.

    Warns and raises as `balanced`.
    """
    from femflex.dynamics.equilibria.system_modes import system_modes

    decided = _decided(case, bodies)
    found = system_modes(decided.system, at)
    _warn(found.about, decided, at)
    return found


def _decided(case: Case | Decided, bodies: Mapping[str, Part] | None = None) -> Decided:
    from femflex.pipeline.decisions import Decided

    return case if isinstance(case, Decided) else decided_at_rest(case, bodies)


def _warn(found: Equilibrium, decided: Decided, at: float | None) -> None:
    """Warn of bodies that are bent, or pulled or pressed along, by more than their strain is good for."""
    known, notes = decided.known, decided.notes
    for bend in deflection_watches(found.model, known):
        bend.moved(found.x[None])
        bend.warn("is", notes.get(bend.name, ""))
    stiffening = StiffeningWatch(found.model, known)
    seen = found.model.observe(np.zeros(1), found.x[None])
    stiffening.watch(seen)
    stiffening.warn("turns at")
    axial = AxialForceWatch(found.model)
    axial.watch(np.array([at or 0.0]), seen)
    axial.warn()
    bends = SpunBends(found.model)
    bends.watch(found.x[None], seen)
    bends.warn()


def keep(
    found: Equilibrium,
    case: Case,
    output: str | Path,
    *,
    force: bool = False,
    ended: str = "",
    decided: Decided | None = None,
) -> None:
    """Write an equilibrium, or the last state before it failed, into a result file of one row at t = 0.

    ended: why there is none; the file is then marked incomplete.
    """
    from femflex.pipeline.recovered import recovered
    from femflex.results import RunWriter

    model = found.model
    attributes = {
        "title": case.title,
        "case_text": case.text,
        "case_path": str(case.path),
        "without": "",
        "integrator": "equilibrium",
        "advice": advice_text(() if decided is None else decided.advice),
        "frame": f"N inertial; attitude from the {model.system.frame.kind} frame",
    }
    stresses, seen = recovered(case, model.system), model.observe(np.zeros(1), found.x[None])
    channels = model.channels | stresses.channels
    with RunWriter(output, channels, model.system.bodies, attributes, rows=1, force=force) as writer:
        writer.write_block(np.zeros(1), seen | stresses.values(seen))
        found_text = ended or f"equilibrium, {found.verdict}"
        writer.finish(not ended, found_text, {"iterations": found.iterations, "residual": found.residual})
