"""From a case to its equilibrium, and that into a result file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.bends import bends
from femflex.advice.stiffening import Stiffening

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.dynamics.equilibria.equilibrium import Equilibrium
    from femflex.dynamics.equilibria.system_modes import SystemModes
    from femflex.system import Part, System


def balanced(case: Case, at: float | None = None, stable: bool = False) -> Equilibrium:
    """The equilibrium of a case, with its loads as at a time [s]; stable: an unstable one is left for one that is.

    Warns of bodies that are bent, or pulled or pressed along, by more than their strain is good for.

    Raises CaseError and ValueError for what cannot be in equilibrium, EquilibriumError when none is found.
    """
    from femflex.dynamics.equilibria.equilibrium import equilibrium

    found = equilibrium(_system_of(case), at, stable)
    _warn(found)
    return found


def case_modes(case: Case, at: float | None = None, bodies: Mapping[str, Part] | None = None) -> SystemModes:
    """The modes of the craft of a case about its equilibrium (`femflex.system_modes`), of these bodies where given.

    Warns and raises as `balanced`.
    """
    from femflex.dynamics.equilibria.system_modes import system_modes

    found = system_modes(_system_of(case, bodies), at)
    _warn(found.about)
    return found


def _system_of(case: Case, bodies: Mapping[str, Part] | None = None) -> System:
    from femflex.pipeline.decisions import build_system

    if case.initial is not None and case.initial.source == "equilibrium":
        case = case.model_copy(update={"initial": None})  # it is what is sought here
    return build_system(case, bodies)


def _warn(found: Equilibrium) -> None:
    """Warn of bodies that are bent, or pulled or pressed along, by more than their strain is good for."""
    for bend in bends(found.model):
        bend.moved(found.x[None])
        bend.warn("is")
    stiffening = Stiffening(found.model)
    stiffening.watch(found.model.observe(np.zeros(1), found.x[None]))
    stiffening.warn("turns at")


def keep(found: Equilibrium, case: Case, output: str | Path, *, force: bool = False, ended: str = "") -> None:
    """Write an equilibrium, or the last state before it failed, into a result file of one row at t = 0.

    ended: why there is none; the file is then marked incomplete.
    """
    from femflex.results import RunWriter

    model = found.model
    attributes = {
        "title": case.title,
        "case_text": case.text,
        "case_path": str(case.path),
        "without": "",
        "integrator": "equilibrium",
        "frame": f"N inertial; attitude from the {model.system.frame.kind} frame",
    }
    with RunWriter(output, model.channels, model.system.bodies, attributes, rows=1, force=force) as writer:
        writer.write_block(np.zeros(1), model.observe(np.zeros(1), found.x[None]))
        told = ended or f"equilibrium, {found.verdict}"
        writer.finish(not ended, told, {"iterations": found.iterations, "residual": found.residual})
