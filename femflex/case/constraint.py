"""[[constraints]] and [[springs]]: rolling discs, knife edges, and springs between two markers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from femflex.case.joint_values import Axis, Damper, Spring
from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import PositiveLength, Quantity


class BetweenTable(Table):
    """An element between a marker of a body and a marker of another, or the origin of the base frame."""

    name: Name
    """Name in channels and messages."""
    body: str
    """Body on which it acts."""
    marker: str = "origin"
    """Marker of that body."""
    parent: str | None = None
    """The other body. Default: the base frame of [attitude]."""
    parent_marker: str = "origin"
    """Marker of the other body."""

    @model_validator(mode="after")
    def _base_has_one_marker(self) -> BetweenTable:
        if self.parent is None and self.parent_marker != "origin":
            refuse(f"found parent_marker {self.parent_marker!r} without a parent; the base frame has only its origin")
        return self


class RollingDisc(BetweenTable):
    """A sharp-edged disc that rolls without slip on a plane through the parent's marker."""

    kind: Literal["rolling_disc"]
    """Selects this constraint: a disc that rolls without slip."""
    radius: PositiveLength
    """Radius of the disc."""
    axis: Axis = (0.0, 0.0, 1.0)
    """Axis of the disc, in the axes of its marker."""
    normal: Axis = (0.0, 0.0, 1.0)
    """Normal of the plane, towards the disc, in the axes of the parent's marker."""


class KnifeEdge(BetweenTable):
    """A blade that does not move sideways."""

    kind: Literal["knife_edge"]
    """Selects this constraint: no sideways velocity."""
    across: Axis = (0.0, 1.0, 0.0)
    """Direction without velocity, in the axes of the marker."""


class SpringTable(BetweenTable):
    """A spring and damper along the line between two markers."""

    stiffness: Spring = 0.0
    """Stiffness along the line between the markers."""
    damping: Damper = 0.0
    """Damping coefficient along that line."""
    length: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Length without spring force."""


Constraint = Annotated[RollingDisc | KnifeEdge, Field(discriminator="kind")]
