"""What a study recommends, put into the case: so that the next study starts from it."""

from __future__ import annotations

from collections.abc import Sequence

from femflex.case import Case
from femflex.studies.convergence import Convergence
from femflex.studies.derivative_ladder import with_derivatives_of
from femflex.studies.function_kinds import FunctionStudy, with_functions_of
from femflex.studies.level import with_level
from femflex.studies.strain_forms import StrainStudy, with_strain_of


def choice(found: Convergence | StrainStudy | FunctionStudy) -> int | str | None:
    """The level to go on with: the recommended one, or else the finest; None when nothing could be compared."""
    if found.recommended is not None or isinstance(found, StrainStudy | FunctionStudy):
        return found.recommended
    return int(found.levels[found.n_resolved - 1])


def with_choice(case: Case, found: Convergence | StrainStudy | FunctionStudy, names: Sequence[str]) -> Case:
    """The case with what a study over these bodies chose."""
    level = choice(found)
    if level is None:
        return case
    if isinstance(found, FunctionStudy):
        assert found.chosen is not None
        return with_functions_of(case, names, *found.chosen)
    if isinstance(found, StrainStudy):
        return with_strain_of(case, names, level)  # type: ignore[arg-type]
    if found.over == "derivatives":
        return with_derivatives_of(case, names, int(level))
    return case.model_copy(
        update={
            "bodies": {
                name: with_level(table, found.over, int(level)) if name in names else table
                for name, table in case.bodies.items()
            }
        }
    )


def choice_text(findings: Sequence[Convergence | StrainStudy | FunctionStudy]) -> str:
    """All choices in one sentence, and what none of the studies reached."""
    said = [f"{found.over} = {choice(found)!r}" for found in findings if choice(found) is not None]
    short = [found.over for found in findings if found.recommended is None]
    if not said:
        return "No study gave a result to choose by."
    text = f"Choose {', '.join(said)}: each study used the results of the ones before it."
    return text + (f" Over {', '.join(short)} the tolerance is not reached." if short else "")
