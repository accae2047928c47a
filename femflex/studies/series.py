"""Several studies in turn: checks before the first of them, and their results put into the case for the next."""

from __future__ import annotations

from collections.abc import Sequence

from femflex.case import Case
from femflex.studies.convergence import Convergence
from femflex.studies.function_kinds import FunctionStudy, with_function_kind
from femflex.studies.levels import varied_names, with_level
from femflex.studies.strain_forms import StrainStudy
from femflex.studies.study import require_study, require_valid_property

Finding = Convergence | StrainStudy | FunctionStudy


def check_studies(case: Case, varied: Sequence[str]) -> None:
    """Raise ValueError when a study in the list is not known, has nothing to vary, or comes too early.

    case: with the strain of its bodies filled in (`pipeline.case_bodies.with_own_strain`).
    """
    require_study(case)
    for word in varied:
        if word not in ("strain", "functions"):
            require_valid_property(word)
        varied_names(case, word)
    if "strain" in varied and "derivatives" in varied[list(varied).index("strain") :]:
        reordered = [word for word in varied if word != "strain"] + ["strain"]
        raise ValueError(
            f"found --over {','.join(varied)}: derivatives can be varied only if the study over strain selects a form "
            f"that has them; give --over {','.join(reordered)}"
        )


def recommended_level(study: Finding) -> int | str | None:
    """The level to continue with: the recommended one, or else the finest; None if nothing could be compared."""
    if study.recommended is not None or isinstance(study, StrainStudy | FunctionStudy):
        return study.recommended
    return int(study.levels[study.n_resolved - 1])


def with_recommended_level(case: Case, study: Finding, names: Sequence[str]) -> Case:
    """The case with the recommendation of a study over these bodies."""
    level = recommended_level(study)
    if level is None:
        return case
    if isinstance(study, FunctionStudy):
        assert study.choice is not None
        return with_function_kind(case, names, *study.choice)
    return with_level(case, names, study.over, level)


def recommendation_text(findings: Sequence[Finding]) -> str:
    """All choices in one sentence, and the studies that did not reach the tolerance."""
    choices = [
        f"{study.over} = {recommended_level(study)!r}" for study in findings if recommended_level(study) is not None
    ]
    unreached = [study.over for study in findings if study.recommended is None]
    if not choices:
        return "No study gave a result to choose by."
    text = f"Choose {', '.join(choices)}: each study used the results of the ones before it."
    return text + (f" Over {', '.join(unreached)} the tolerance is not reached." if unreached else "")
