"""[[constraints]]: rolling discs and knife edges."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from femflex.case.joint_values import Axis
from femflex.noun.values import PositiveLength
from femflex.system.spring import MarkerLink


class RollingDisc(MarkerLink):
    """A sharp-edged disc that rolls without slip on a plane through the parent's marker."""

    kind: Literal["rolling_disc"]
    """Selects this constraint: a disc that rolls without slip."""
    radius: PositiveLength
    """Radius of the disc."""
    axis: Axis = (0.0, 0.0, 1.0)
    """Axis of the disc, in the axes of its marker."""
    normal: Axis = (0.0, 0.0, 1.0)
    """Normal of the plane, towards the disc, in the axes of the parent's marker."""


class KnifeEdge(MarkerLink):
    """A blade that does not move sideways."""

    kind: Literal["knife_edge"]
    """Selects this constraint: no sideways velocity."""
    across: Axis = (0.0, 1.0, 0.0)
    """Direction without velocity, in the axes of the marker."""


Constraint = Annotated[RollingDisc | KnifeEdge, Field(discriminator="kind")]
