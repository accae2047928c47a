"""[[constraints]] and [[springs]]: rolling discs, knife edges, and springs between two markers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from femflex.case.base import Name, Table, refuse
from femflex.case.joint_values import Axis, Damper, Spring
from femflex.case.values import PositiveLength, Quantity


class BetweenTable(Table):
    """What acts between a marker of a body and a marker of another, or the origin of the base frame."""

    name: Name
    body: str
    marker: str = "origin"
    parent: str | None = None
    """The other body; none: the base frame of [attitude]."""
    parent_marker: str = "origin"

    @model_validator(mode="after")
    def _base_has_one_marker(self) -> BetweenTable:
        if self.parent is None and self.parent_marker != "origin":
            refuse(f"found parent_marker {self.parent_marker!r} without a parent; the base frame has only its origin")
        return self


class RollingDisc(BetweenTable):
    """A sharp-edged disc that rolls without slip on a plane through the parent's marker."""

    kind: Literal["rolling_disc"]
    radius: PositiveLength
    axis: Axis = (0.0, 0.0, 1.0)
    """Of the disc, axes of its marker."""
    normal: Axis = (0.0, 0.0, 1.0)
    """Of the plane towards the disc, axes of the parent's marker."""


class KnifeEdge(BetweenTable):
    """A blade that does not move sideways."""

    kind: Literal["knife_edge"]
    across: Axis = (0.0, 1.0, 0.0)
    """Direction in which the marker does not move, along its own axes."""


class SpringTable(BetweenTable):
    """A spring and damper along the line between two markers."""

    stiffness: Spring = 0.0
    damping: Damper = 0.0
    length: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """At which the spring is free."""


Constraint = Annotated[RollingDisc | KnifeEdge, Field(discriminator="kind")]
