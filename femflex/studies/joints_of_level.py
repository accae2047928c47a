"""Static shapes of joints of a case whose bodies have another number of modes: those chosen for that number."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from femflex.case import Case, CaseError
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable
from femflex.case.deploying import DeployingTable
from femflex.case.reduction import Stretchable
from femflex.pipeline.decisions import with_own_joints
from femflex.studies.level_tables import with_level
from femflex.warning import PhysicsWarning


def with_joints_of_level(case: Case, case_as_given: Case, names: Iterable[str], n: int) -> Case:
    """The case with the static shapes of joints that the case as given has when the named bodies have n modes.

    case: with strains and static shapes filled in. If the system with so few modes cannot be built, the case is
    returned unchanged; the problem is reported when the level is run.
    """
    tables = {name: with_level(case_as_given.bodies[name], "modes", n) for name in names}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # issued where the bodies are built
            joined = with_own_joints(case_as_given.model_copy(update={"bodies": {**case_as_given.bodies, **tables}}))
    except CaseError:
        return case
    bodies = {name: _with_joints_of(table, joined.bodies[name]) for name, table in case.bodies.items()}
    return case.model_copy(update={"bodies": bodies})


def _with_joints_of(table: BodyTable, source: BodyTable | None) -> BodyTable:
    """The table with the static shapes of joints of another table, or without any."""
    if source is not None and joints_of(table) == joints_of(source):
        return table
    if isinstance(table, AnalyticTable | DeployingTable):
        assert table.functions is not None
        joints = [] if source is None else joints_of(source)
        return table.model_copy(update={"functions": table.functions.model_copy(update={"joints": joints})})
    assert isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable)
    joints = {} if source is None else joints_of(source)
    reduction = table.reduction.model_copy(update={"joints": joints})
    return table.model_copy(update={"reduction": reduction})


def without_joints(case: Case, names: Iterable[str]) -> Case:
    """The case without static shapes of joints in the named bodies, which leave them open."""
    bodies = {name: _with_joints_of(case.bodies[name], None) for name in names}
    return case.model_copy(update={"bodies": {**case.bodies, **bodies}})


def joints_of(table: BodyTable) -> object:
    """Static shapes of joints that a table requests."""
    if isinstance(table, AnalyticTable | DeployingTable):
        return None if table.functions is None else table.functions.joints
    return getattr(getattr(table, "reduction", None), "joints", None)
