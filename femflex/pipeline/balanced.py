"""From a case to its equilibrium, and that into a result file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.dynamics.reports.bends import bends
from femflex.pipeline.stiffening import Stiffening

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.dynamics.equilibria.equilibrium import Equilibrium


def balanced(case: Case, at: float | None = None, stable: bool = False) -> Equilibrium:
    """The equilibrium of a case, with its loads as at a time [s]; stable: an unstable one is left for one that is.

    Warns of bodies that are bent, or pulled or pressed along, by more than their strain is good for.

    Raises CaseError and ValueError for what cannot be in equilibrium, EquilibriumError when none is found.
    """
    from femflex.case.builders import build_system
    from femflex.dynamics.equilibria.equilibrium import equilibrium

    if case.initial is not None and case.initial.source == "equilibrium":
        case = case.model_copy(update={"initial": None})  # it is what is sought here
    found = equilibrium(build_system(case), at, stable)
    for bend in bends(found.model):
        bend.moved(found.x[None])
        bend.warn("is")
    stiffening = Stiffening(found.model)
    stiffening.watch(found.model.observe(np.zeros(1), found.x[None]))
    stiffening.warn("turns at")
    return found


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
