"""Static shapes of joints of a case whose bodies keep another number of modes: those it then gets."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from femflex.case import Case, CaseError
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable
from femflex.case.deploying import DeployingTable
from femflex.case.reduction import Stretchable
from femflex.pipeline.decisions import with_own_joints
from femflex.studies.level import with_level
from femflex.warning import PhysicsWarning


def with_joints_of_level(case: Case, given: Case, names: Iterable[str], n: int) -> Case:
    """The case with the static shapes of joints that the case as given gets if the named bodies keep n modes.

    case: with strains and static shapes written out. Where the system with so few modes cannot be built, all is left
    as it is: what it lacks is reported where the level is run.
    """
    tables = {name: with_level(given.bodies[name], "modes", n) for name in names}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # given where the bodies are built
            joined = with_own_joints(given.model_copy(update={"bodies": {**given.bodies, **tables}}))
    except CaseError:
        return case
    bodies = {name: _with_joints_of(table, joined.bodies[name]) for name, table in case.bodies.items()}
    return case.model_copy(update={"bodies": bodies})


def _with_joints_of(table: BodyTable, other: BodyTable | None) -> BodyTable:
    """The table with the static shapes of joints of another, or with none."""
    if other is not None and joints_of(table) == joints_of(other):
        return table
    if isinstance(table, AnalyticTable | DeployingTable):
        assert table.functions is not None
        joints = [] if other is None else joints_of(other)
        return table.model_copy(update={"functions": table.functions.model_copy(update={"joints": joints})})
    assert isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable)
    joints = {} if other is None else joints_of(other)
    reduction = table.reduction.model_copy(update={"joints": joints})
    return table.model_copy(update={"reduction": reduction})


def without_joints(case: Case, names: Iterable[str]) -> Case:
    """The case whose named bodies, which leave static shapes of joints open, have none."""
    bodies = {name: _with_joints_of(case.bodies[name], None) for name in names}
    return case.model_copy(update={"bodies": {**case.bodies, **bodies}})


def joints_of(table: BodyTable) -> object:
    """What a table says of static shapes of joints."""
    if isinstance(table, AnalyticTable | DeployingTable):
        return None if table.functions is None else table.functions.joints
    return getattr(getattr(table, "reduction", None), "joints", None)
