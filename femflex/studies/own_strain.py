"""The strain that bodies of a case really get: what they say, or what was chosen where they say nothing."""

from __future__ import annotations

import warnings

from femflex.body import FlexibleBody
from femflex.case import Case, CaseError
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable, Strain
from femflex.case.builders import build_body
from femflex.case.reduction import Stretchable
from femflex.warning import PhysicsWarning


def has_strain(table: BodyTable) -> bool:
    """Whether a body has a choice of strain."""
    if isinstance(table, AnalyticTable):
        return bool(table.functions.y or table.functions.z)
    return isinstance(table, FlexibleTable) and (table.cut is not None or isinstance(table.reduction, Stretchable))


def with_own_strain(case: Case) -> Case:
    """The case with the strain written out that each body without a word of it gets: every level of a study keeps it.

    A body that cannot be built is left as it is: what it lacks is told where it is needed.
    """
    bodies = dict(case.bodies)
    for name, table in case.bodies.items():
        silent = isinstance(table, FlexibleTable | AnalyticTable) and table.strain is None and has_strain(table)
        if not silent or getattr(table, "cut", None) is not None:
            continue
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", PhysicsWarning)  # told when the study builds it
                own = strain_name(build_body(case, name))
        except CaseError:
            continue
        bodies[name] = table.model_copy(update={"strain": own})
    return case if bodies == case.bodies else case.model_copy(update={"bodies": bodies})


def strain_name(body: FlexibleBody) -> Strain:
    """The form of strain that a body holds."""
    if body.condensed:
        return "condensed"
    return "linear" if body.strain.is_linear else "nonlinear"
