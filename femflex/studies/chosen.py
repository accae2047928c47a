"""What a study recommends, put into the case: so that the next study starts from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from femflex.case import Case
from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable
from femflex.studies.convergence import Convergence
from femflex.studies.derivative_ladder import with_derivatives_of
from femflex.studies.strain_forms import StrainStudy, with_strain_of


def choice(found: Convergence | StrainStudy) -> int | str | None:
    """The level to go on with: the recommended one, or else the finest; None when nothing could be compared."""
    if found.recommended is not None or isinstance(found, StrainStudy):
        return found.recommended
    return int(found.levels[found.told - 1])


def with_choice(case: Case, found: Convergence | StrainStudy, names: Sequence[str]) -> Case:
    """The case with what a study over these bodies chose."""
    level = choice(found)
    if level is None:
        return case
    if isinstance(found, StrainStudy):
        return with_strain_of(case, names, level)  # type: ignore[arg-type]
    if found.over == "derivatives":
        return with_derivatives_of(case, names, int(level))
    return case.model_copy(
        update={
            "bodies": {
                name: _with_level(table, found.over, int(level)) if name in names else table
                for name, table in case.bodies.items()
            }
        }
    )


def _with_level(table: BodyTable, over: str, level: int) -> BodyTable:
    """The table with so many modes or segments, or refined so often more."""
    if isinstance(table, AnalyticTable):
        given = {key: level for key in ("y", "z", "axial", "torsion") if getattr(table.functions, key)}
        return table.model_copy(update={"functions": table.functions.model_copy(update=given)})
    if isinstance(table, FileTable):
        return table.model_copy(update={"modes": level})
    assert isinstance(table, FlexibleTable)
    update: dict[str, Any] = {}
    if over == "mesh":
        update = {"refine": table.refine + level}
    elif over == "segments":
        cut = [m.model_copy(update={"segments": level}) if m.segments is not None else m for m in table.members]
        update = {"members": cut}
    elif table.reduction is not None:
        update = {"reduction": table.reduction.model_copy(update={"modes": level})}
    return table.model_copy(update=update)


def choice_text(findings: Sequence[Convergence | StrainStudy]) -> str:
    """All choices in one sentence, and what none of the studies reached."""
    said = [f"{found.over} = {choice(found)!r}" for found in findings if choice(found) is not None]
    short = [found.over for found in findings if found.recommended is None]
    if not said:
        return "No study could choose anything."
    told = f"Choose {', '.join(said)}: each study was made with what the ones before it chose."
    return told + (f" Over {', '.join(short)} the tolerance is not reached." if short else "")
