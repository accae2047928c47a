"""Checks that an unfinished run can be resumed with a case; their errors name what has changed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import femflex
from femflex.advice.limits import SAME_MODEL, SAME_TIME
from femflex.integrate import INTEGRATORS
from femflex.pipeline.inputs import changed_inputs, differences, inputs_of
from femflex.pipeline.rebuilt import check_agreement, check_varying, effectors_of

if TYPE_CHECKING:
    from femflex.arrays import Array
    from femflex.body import FlexibleBody
    from femflex.case import Case
    from femflex.dynamics import Model
    from femflex.results import Run, RunBody
    from femflex.system import Controller, Effector


def is_finished(case: Case, output: Path) -> bool:
    """Whether the run in the output file is complete and as long as the case says, so that nothing is left to resume.

    Raises ValueError when it was begun with other inputs, or by another version of femflex, and says which.
    """
    from femflex.results import open_run

    with open_run(output) as run:
        check_same_inputs(run, case)
        return run.complete and not _is_longer(run, case)


def check_same_inputs(run: Run, case: Case) -> None:
    """Raise ValueError when the run cannot be resumed with the case as it is now."""
    begun = inputs_of(run)
    if begun is None:
        raise ValueError(
            f"{run.path} does not hold digests of the inputs of its run, so they cannot be compared with those of the "
            f"case; run it anew (without --resume)"
        )
    check_case_text(run, begun, case.path)
    if changed := changed_inputs(begun, case):
        raise ValueError(
            f"{run.path} was begun with another case: {changed}. Undo the change to resume it, or start anew without "
            f"--resume"
        )
    if run.versions["femflex"] != femflex.__version__:
        raise ValueError(
            f"{run.path} was begun with femflex {run.versions['femflex']}, and this is {femflex.__version__}; resume "
            f"it with that version, or start anew without --resume"
        )


def check_same_model(model: Model, output: Path) -> None:
    """Raise ValueError when the unfinished run was begun with something else switched off, or with another model."""
    from femflex.results import open_run

    with open_run(output) as unfinished:
        _check_omitted(unfinished.without, model.omitted, output)
        check_varying(unfinished, model)
        check_same_bodies(unfinished, model)
        if len(unfinished):
            unfinished.states()  # all of them finite
            check_agreement(unfinished, model)


def check_same_effectors(effectors: Sequence[Effector | Controller], output: Path) -> None:
    """Raise ValueError when the unfinished run was begun with other effectors from Python than these."""
    from femflex.results import open_run

    with open_run(output) as unfinished:
        begun = effectors_of(unfinished)
    now = [effector.name for effector in effectors]
    if begun != now:
        first, second = (", ".join(names) or "none" for names in (begun, now))
        raise ValueError(
            f"{output} was begun with the effectors {first} from Python, and now there are {second}; resume it from "
            f"Python by femflex.run(..., resume=True, effectors=...) with the same ones, or start anew"
        )


def check_same_times(times: Array, output: Path) -> None:
    """Raise ValueError when the output times (n_t,) [s] do not continue those in the file."""
    from femflex.results import open_run

    with open_run(output) as run:
        written = run.time
    if len(written) and times[-1] < (1 - SAME_TIME) * written[-1]:
        raise ValueError(
            f"{output} holds rows up to {written[-1]:.9g} s, and the case now ends at {times[-1]:.9g} s; give a later "
            f"end, or start anew without --resume"
        )
    same = min(len(written), len(times))
    differ = np.flatnonzero(np.abs(times[:same] - written[:same]) > SAME_TIME * times[-1])
    last = len(written) - 1  # of a complete run: its end, which need not be a multiple of the output step
    if len(differ) and not (differ[0] == last and written[last] < times[last]):
        k = differ[0]
        raise ValueError(
            f"{output} holds a row at {written[k]:.9g} s where the case now has one at {times[k]:.9g} s; a resumed run "
            "may end earlier or later, but keeps its other output times; set run.output_step to that of the file"
        )


def integrator_of(output: Path) -> str:
    """Name of the integrator that the run in the file was begun with."""
    from femflex.results import open_run

    with open_run(output) as run:
        name = str(run.attributes.get("integrator", ""))
    if name not in INTEGRATORS:
        raise ValueError(
            f"{output} was begun with the integrator {name!r}, which is not known; start anew without --resume"
        )
    return name


def check_case_text(run: Run, begun: Mapping[str, Any], path: Path) -> None:
    """Raise ValueError when the case text in the file is not that of the inputs in it, as after an edit."""
    from femflex.case.named_files import model_values
    from femflex.case.read import parse_case

    try:
        values = json.loads(json.dumps(model_values(parse_case(run.case_text, path))))
        difference = next(differences(begun["values"], values), "")
    except ValueError as error:
        difference = f"it cannot be read: {str(error).splitlines()[-1]}"
    if difference:
        raise ValueError(
            f"{run.path} keeps a case text that is not of its run ({difference}), so the file was edited; start anew "
            "without --resume"
        )


def check_same_bodies(run: Run, model: Model) -> None:
    """Raise ValueError when the bodies or channels in the file are not those of the model."""
    bodies, difference = run.bodies(), ""
    if bodies.keys() != model.system.bodies.keys():
        difference = f"it has the bodies {sorted(bodies)}, and the model has {sorted(model.system.bodies)}"
    for path, channel in model.channels.items():
        if not difference and run.channels.get(path) != channel:
            difference = f"its channel {path} is missing or has other columns, names or units"
    for name, file_body in bodies.items():
        if not difference and (key := _difference(file_body, model.system.bodies[name])):
            difference = f"{key} of the body {name} is not that of the model"
    if difference:
        raise ValueError(f"{run.path} does not belong to this model: {difference}. Start anew without --resume")


def _difference(file_body: RunBody, body: FlexibleBody) -> str:
    """Name of the first quantity of a body that differs between the file and the body; empty if none does."""
    pairs: dict[str, tuple[Any, Any]] = {
        "mass": (file_body.mass, body.moments.mass),
        "omega": (file_body.omega, body.omega if len(body.omega) else np.full(body.n_shapes, np.nan)),
        **{f"marker {name}": (file_body.markers.get(name, np.nan), at.position) for name, at in body.markers.items()},
    }
    if body.skin is not None:
        pairs |= {key: (getattr(file_body.skin, key, np.nan), getattr(body.skin, key)) for key in ("points", "shapes")}
    for key, (a, b) in pairs.items():
        size = float(np.abs(np.nan_to_num(b)).max(initial=0.0))
        if np.shape(a) != np.shape(b) or not np.allclose(a, b, rtol=SAME_MODEL, atol=SAME_MODEL * size, equal_nan=True):
            return key
    return ""


def _is_longer(run: Run, case: Case) -> bool:
    """Whether the case asks for a longer run than the complete one in the file."""
    begun = inputs_of(run) or {"length": {}}
    for key in ("duration", "orbits"):
        now = getattr(case.run, key)
        if now is not None and key in begun["length"]:
            return bool(now > begun["length"][key])
    return True


def _check_omitted(begun: Sequence[str], now: Sequence[str], output: Path) -> None:
    if set(begun) != set(now):
        first, second = (", ".join(names) or "nothing" for names in (begun, now))
        raise ValueError(
            f"{output} was begun with {first} switched off, not {second}; resume it likewise, or start anew"
        )
