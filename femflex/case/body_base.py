"""Keys that all kinds of [bodies.<name>] share."""

from __future__ import annotations

from pydantic import Field

from femflex.case.initial import InitialTable
from femflex.case.shape import MarkerTable
from femflex.noun.table import Name, Table
from femflex.noun.values import Position


class RecoveryTable(Table):
    """A place at which section forces and stresses are written along the run, as channels
    recovery/BODY.PLACE/QUANTITY."""

    position: Position
    """Position in the body frame; the nearest point at which strain is known is taken."""
    quantities: list[str] | None = None
    """Section forces and stresses, such as "von_mises" or "moment_y". Default: all that the body has."""


class BodyTable(Table):
    """Keys that all bodies share."""

    markers: dict[Name, MarkerTable] = Field(default_factory=dict)
    """Markers by name: points with axes where joints, loads and outputs attach."""
    initial: InitialTable | None = None
    """Elastic state at t = 0. Default: undeformed and at rest."""
    recovery: dict[Name, RecoveryTable] = Field(default_factory=dict)
    """Places at which section forces and stresses are written along the run."""

    def built_in_markers(self) -> tuple[str, ...]:
        """Names of markers the body has without being declared."""
        return ("origin",)
