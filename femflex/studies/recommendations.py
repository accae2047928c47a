"""Results of studies put into the case, so that the next study starts from them."""

from __future__ import annotations

from collections.abc import Sequence

from femflex.case import Case
from femflex.studies.convergence import Convergence
from femflex.studies.derivative_levels import with_derivative_count
from femflex.studies.function_kinds import FunctionStudy, with_function_kind
from femflex.studies.level_tables import with_level
from femflex.studies.strain_forms import StrainStudy, with_strain_form


def recommended_level(study: Convergence | StrainStudy | FunctionStudy) -> int | str | None:
    """The level to continue with: the recommended one, or else the finest; None if nothing could be compared."""
    if study.recommended is not None or isinstance(study, StrainStudy | FunctionStudy):
        return study.recommended
    return int(study.levels[study.n_resolved - 1])


def with_recommended_level(case: Case, study: Convergence | StrainStudy | FunctionStudy, names: Sequence[str]) -> Case:
    """The case with the recommendation of a study over these bodies."""
    level = recommended_level(study)
    if level is None:
        return case
    if isinstance(study, FunctionStudy):
        assert study.choice is not None
        return with_function_kind(case, names, *study.choice)
    if isinstance(study, StrainStudy):
        return with_strain_form(case, names, level)  # type: ignore[arg-type]
    if study.over == "derivatives":
        return with_derivative_count(case, names, int(level))
    return case.model_copy(
        update={
            "bodies": {
                name: with_level(table, study.over, int(level)) if name in names else table
                for name, table in case.bodies.items()
            }
        }
    )


def recommendation_text(findings: Sequence[Convergence | StrainStudy | FunctionStudy]) -> str:
    """All choices in one sentence, and the studies that did not reach the tolerance."""
    choices = [
        f"{study.over} = {recommended_level(study)!r}" for study in findings if recommended_level(study) is not None
    ]
    unreached = [study.over for study in findings if study.recommended is None]
    if not choices:
        return "No study gave a result to choose by."
    text = f"Choose {', '.join(choices)}: each study used the results of the ones before it."
    return text + (f" Over {', '.join(unreached)} the tolerance is not reached." if unreached else "")
