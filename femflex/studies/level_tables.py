"""The table of a body at a level of a study."""

from __future__ import annotations

from typing import Any

from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable
from femflex.case.deploying import DeployingTable
from femflex.case.matrices import MatricesTable


def with_level(table: BodyTable, over: str, level: int) -> BodyTable:
    """The table with this number of modes or segments, or with this many further refinements."""
    if isinstance(table, AnalyticTable | DeployingTable):
        assert table.functions is not None
        counts = {key: level for key in ("y", "z", "axial", "torsion") if getattr(table.functions, key)}
        return table.model_copy(update={"functions": table.functions.model_copy(update=counts)})
    if isinstance(table, FileTable):
        return table.model_copy(update={"modes": level})
    if isinstance(table, MatricesTable):
        assert table.reduction is not None
        return table.model_copy(update={"reduction": table.reduction.model_copy(update={"modes": level})})
    assert isinstance(table, FlexibleTable)
    update: dict[str, Any] = {}
    if over == "mesh":
        update = {"refine": table.refine + level}
    elif over == "segments":
        members = [m.model_copy(update={"segments": level}) if m.segments is not None else m for m in table.members]
        update = {"members": members}
    elif table.reduction is not None:
        update = {"reduction": table.reduction.model_copy(update={"modes": level})}
    return table.model_copy(update=update)
