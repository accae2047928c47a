"""Markers of bodies, and what is drawn of rigid ones."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from femflex.case.base import Orientation, Table
from femflex.case.values import Direction, Position, PositiveLength, Quantity


class MarkerTable(Table):
    """A named place on a body, with its own axes."""

    position: Position | None = None
    """On a meshed body: that of the mesh point nearest to it."""
    group: str | None = None
    """Mesh group (point, edge, face): mean displacement and least-squares rotation of its nodes."""
    orientation: Orientation | None = None
    """Axes of the marker; left out, those of the body."""


class BoxShape(Table):
    """A box to draw, edges along the body axes unless turned."""

    kind: Literal["box"]
    size: Annotated[Position, Quantity("m", (3,), above=0.0)]
    position: Position = (0.0, 0.0, 0.0)
    orientation: Orientation | None = None


class CylinderShape(Table):
    """A cylinder to draw, along its axis."""

    kind: Literal["cylinder"]
    radius: PositiveLength
    length: PositiveLength
    axis: Direction = (0.0, 0.0, 1.0)
    position: Position = (0.0, 0.0, 0.0)


class MeshShape(Table):
    """A mesh file to draw."""

    kind: Literal["mesh"]
    file: str
    mesh_unit: Literal["m", "mm", "cm", "inch"] = "m"
    position: Position = (0.0, 0.0, 0.0)
    orientation: Orientation | None = None


Shape = Annotated[BoxShape | CylinderShape | MeshShape, Field(discriminator="kind")]
