"""What every kind of [bodies.<name>] may say."""

from __future__ import annotations

from pydantic import Field

from femflex.case.base import Name, Table
from femflex.case.initial import InitialTable
from femflex.case.shape import MarkerTable


class BodyTable(Table):
    """What every body may say."""

    markers: dict[Name, MarkerTable] = Field(default_factory=dict)
    """Markers by name: points with axes where joints, loads and outputs attach."""
    initial: InitialTable | None = None
    """Elastic state at t = 0. Left out: undeformed and at rest."""

    def own_markers(self) -> tuple[str, ...]:
        """Names of markers the body has without being declared."""
        return ("origin",)
