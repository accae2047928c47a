"""The compiled model of a run, built again from the case text that its file keeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.limits import SAME_MODEL

if TYPE_CHECKING:
    from femflex.dynamics import Model
    from femflex.results import Run
    from femflex.system import Variation

STATES = ("q", "u", "z")
CHECKED = ("monitors/kinetic", "monitors/elastic")


def rebuilt(run: Run, case: str | Path | None = None, varying: Mapping[str, Variation] | None = None) -> Model:
    """The model that made a run, with the same terms switched off.

    case: where the case file is now, when it has moved; meshes are searched in its folder, its text is the run's.
    varying: the bodies that vary with time, as they were handed to the run.
    Raises ValueError when the run keeps no case, its folder is gone, its inputs have changed or Python added effectors;
    CaseError when the meshes are missing.
    """
    from femflex.case.read import parse_case
    from femflex.dynamics import compile_system
    from femflex.pipeline.decisions import build_system
    from femflex.pipeline.inputs import changed_inputs, inputs_of

    if not run.case_text:
        raise ValueError(f"{run.path} keeps no case text, so its model cannot be built again")
    case_path = Path(case if case is not None else str(run.attributes.get("case_path", "case.toml")))
    if not case_path.parent.is_dir():
        raise ValueError(
            f"{run.path} was made from {case_path}, and that folder is not here; say where the case file is now "
            "(--case), "
            f"for the meshes in its folder"
        )
    parsed_case = parse_case(run.case_text, case_path)
    begun = inputs_of(run)
    if begun is not None and (changed := changed_inputs(begun, parsed_case)):
        raise ValueError(f"{run.path} was made with other inputs: {changed}. Undo the change, or run the case anew")
    if effectors := effectors_of(run):
        raise ValueError(
            f"{run.path} was made with effectors from Python ({', '.join(effectors)}), which no case text holds, so "
            "its "
            f"model cannot be built again; compile it in Python with the same ones"
        )
    system = build_system(parsed_case)
    model = compile_system(replace(system, varying={**system.varying, **(varying or {})}))
    check_varying(run, model)
    if run.without:
        model = model.without(*run.without)
    check_agreement(run, model)
    return model


def effectors_of(run: Run) -> list[str]:
    """Names of the effectors and controllers that Python gave to a run in addition to its case."""
    return list(filter(None, str(run.attributes.get("effectors", "")).split(", ")))


def check_varying(run: Run, model: Model) -> None:
    """Raise ValueError when other bodies vary with time in the model than did in the run."""
    begun, now = str(run.attributes.get("varying", "")), ", ".join(sorted(model.system.varying))
    if begun != now:
        raise ValueError(
            f"{run.path} was made with bodies that vary with time: {begun or 'none'}; now there are: {now or 'none'}. "
            "The file does not keep the functions that write their properties: pass the same ones again from Python "
            "(`varying`)"
        )


def check_agreement(run: Run, model: Model) -> None:
    """Raise ValueError when the run's last row differs from the model's channels in the same state."""
    if not len(run):
        raise ValueError(f"{run.path} holds no instants")
    expected = {path: channel.names for path, channel in model.channels.items() if path in STATES}
    same = {path: run.names(path) for path in STATES if path in run} == expected
    if same:
        last = slice(len(run) - 1, len(run))
        channels = model.observe(run.read("time", last), run.states(last))
        checked = [path for path in CHECKED if path in channels and path in run]
        size = max((float(np.abs(run[path]).max()) for path in checked), default=0.0)
        same = all(
            np.allclose(channels[path], run.read(path, last), rtol=SAME_MODEL, atol=1e-9 * size) for path in checked
        )
    if not same:
        raise ValueError(
            f"the model built again from the case text of {run.path} is not the one that made it: "
            f"its meshes, or femflex, have changed since. Run the case anew."
        )
