"""Checks of a list of studies before the first of them runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from femflex.case import Case
from femflex.studies.derivative_levels import derivative_names
from femflex.studies.function_kinds import function_names
from femflex.studies.levels import mesh_names, mode_names
from femflex.studies.segment_levels import segment_names
from femflex.studies.strain_forms import strain_names
from femflex.studies.study import require_study, require_valid_property

NAMES: dict[str, Callable[[Case], list[str]]] = {
    "modes": mode_names,
    "mesh": mesh_names,
    "derivatives": derivative_names,
    "segments": segment_names,
    "strain": strain_names,
    "functions": function_names,
}


def check_studies(case: Case, varied: Sequence[str]) -> None:
    """Raise ValueError when a study in the list is not known, has nothing to vary, or comes too early.

    case: with the strain of its bodies filled in (`pipeline.case_bodies.with_own_strain`).
    """
    require_study(case)
    for word in varied:
        if word not in ("strain", "functions"):
            require_valid_property(word)
        NAMES[word](case)
    if "strain" in varied and "derivatives" in varied[list(varied).index("strain") :]:
        reordered = [word for word in varied if word != "strain"] + ["strain"]
        raise ValueError(
            f"found --over {','.join(varied)}: derivatives can be varied only if the study over strain selects a form "
            f"that has them; give --over {','.join(reordered)}"
        )
