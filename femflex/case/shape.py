"""Markers of bodies, and shapes drawn for rigid bodies."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from femflex.noun.table import Orientation, Table
from femflex.noun.values import Direction, Position, PositiveLength, Quantity


class MarkerTable(Table):
    """A named place on a body, with its own axes."""

    position: Position | None = None
    """Position in the body frame. On a meshed body: the nearest mesh point is taken."""
    group: str | None = None
    """Mesh group (point, edge, face): mean displacement and least-squares rotation of its nodes."""
    orientation: Orientation | None = None
    """Axes of the marker in the body: a rotation matrix (columns are the axes), { sequence, angles }, or two directions
    such as { x = [1, 1, 0], y = [0, 0, 1] }. Default: those of the body."""


class BoxShape(Table):
    """A box to draw, edges along the body axes unless turned."""

    kind: Literal["box"]
    """Selects this shape: a box."""
    size: Annotated[Position, Quantity("m", (3,), above=0.0)]
    """Lengths of the three edges."""
    position: Position = (0.0, 0.0, 0.0)
    """Centre of the box in the body frame."""
    orientation: Orientation | None = None
    """Axes of the shape in the body, written as for markers. Default: those of the body."""


class CylinderShape(Table):
    """A cylinder to draw, along its axis."""

    kind: Literal["cylinder"]
    """Selects this shape: a cylinder."""
    radius: PositiveLength
    """Radius of the cylinder."""
    length: PositiveLength
    """Length of the cylinder along its axis."""
    axis: Direction = (0.0, 0.0, 1.0)
    """Direction of the axis in the body frame."""
    position: Position = (0.0, 0.0, 0.0)
    """Centre of the cylinder in the body frame."""


class MeshShape(Table):
    """A mesh file to draw."""

    kind: Literal["mesh"]
    """Selects this shape: a mesh file."""
    file: str
    """Mesh file, relative to the case file."""
    mesh_unit: Literal["m", "mm", "cm", "inch"] = "m"
    """Unit of the mesh file's coordinates."""
    position: Position = (0.0, 0.0, 0.0)
    """Origin of the mesh in the body frame."""
    orientation: Orientation | None = None
    """Axes of the shape in the body, written as for markers. Default: those of the body."""


Shape = Annotated[BoxShape | CylinderShape | MeshShape, Field(discriminator="kind")]
