"""Nonholonomic constraints A(q) u = b(t): a disc that rolls on a plane, a knife edge, and rows that the user writes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

from numpy.typing import ArrayLike
from pydantic import Field

from femflex.arrays import Array
from femflex.noun.table import Name, Table
from femflex.noun.values import Axis, PositiveLength, Whole
from femflex.system.spring import MarkerLink

Rows = Callable[[float, Array], tuple[Array, Array]]  # (t, q) -> A (n_rows, n_u), b (n_rows,)


class RollingDisc(MarkerLink):
    """A sharp-edged disc that rolls without slip on a plane through the parent's marker."""

    kind: Literal["rolling_disc"] = "rolling_disc"
    """Selects this constraint: a disc that rolls without slip."""
    radius: PositiveLength
    """Radius of the disc."""
    axis: Axis = (0.0, 0.0, 1.0)
    """Axis of the disc, in the axes of its marker."""
    normal: Axis = (0.0, 0.0, 1.0)
    """Normal of the plane, towards the disc, in the axes of the parent's marker."""

    n_rows: ClassVar[int] = 3


class KnifeEdge(MarkerLink):
    """A blade that does not move sideways."""

    kind: Literal["knife_edge"] = "knife_edge"
    """Selects this constraint: no sideways velocity."""
    across: Axis = (0.0, 1.0, 0.0)
    """Direction without velocity, in the axes of the marker."""

    n_rows: ClassVar[int] = 1


class VelocityRows(Table):
    """The general form of a constraint, A(q) u = b(t), as a function of Python."""

    name: Name
    """Name in channels and messages."""
    n_rows: Whole
    """Number of its rows."""
    function: Rows
    """A (n_rows, n_u) and b (n_rows,) of (t, q)."""

    kind: ClassVar[str] = "rows"
    body: ClassVar[str | None] = None
    parent: ClassVar[str | None] = None
    marker: ClassVar[str] = "origin"
    parent_marker: ClassVar[str] = "origin"


Constraint = Annotated[RollingDisc | KnifeEdge, Field(discriminator="kind")]  # of a case
Nonholonomic = RollingDisc | KnifeEdge | VelocityRows


def rolling_disc(name: str, body: str, radius: float, **where: Any) -> RollingDisc:
    """A sharp-edged disc of that radius [m] that rolls without slip on the plane through marker P."""
    return RollingDisc(name=name, body=body, radius=radius, **where)


def knife_edge(name: str, body: str, across: ArrayLike, **where: Any) -> KnifeEdge:
    """A blade at marker Q that does not move in the direction `across` (3,), components of Q."""
    return KnifeEdge(name=name, body=body, across=across, **where)


def velocity_rows(name: str, n_rows: int, function: Rows) -> VelocityRows:
    """The general form A(q) u = b(t): function(t, q) gives A (n_rows, n_u) and b (n_rows,).

    u is that of System.velocity_names(). The function is called from Python several times per step, which takes some
    ten microseconds each; A and b must be smooth, for their rates along the motion are taken by differences.
    """
    return VelocityRows(name=name, n_rows=n_rows, function=function)
