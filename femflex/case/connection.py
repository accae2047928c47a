"""[[bodies.<name>.connections]] and [bodies.<name>.regions]: connections of members, and groups of mesh points."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from femflex.noun.table import Table, exactly_one
from femflex.noun.values import Direction, Plain, Position, Whole

Component = Literal["x", "y", "z", "rx", "ry", "rz"]
Axes = tuple[Direction, Direction, Direction]


class _Referenced(Table):
    """A connection with one reference node."""

    group: str
    """Mesh group whose nodes are connected."""
    reference: str | None = None
    """Mesh group of the one reference node; with position, the name that a new node gets. Markers, clamps and point
    masses may name it. Default: named after the group."""
    position: Position | None = None
    """Position of a new reference node in the body frame. Default: the node of the group `reference`."""

    @property
    def reference_group(self) -> str:
        """Group of the reference node."""
        return self.reference or f"{self.group} reference"


class RigidInterfaceTable(_Referenced):
    """The nodes of a group move with a reference node as one rigid piece (RBE2)."""

    kind: Literal["rigid"]
    """Selects this connection: a rigid one."""
    components: Annotated[tuple[Component, ...], Field(min_length=1)] = ("x", "y", "z", "rx", "ry", "rz")
    """Components of the nodes that follow the reference."""
    axes: Axes | None = None
    """Axes of the components: three directions at right angles. Default: those of the body."""

    @model_validator(mode="after")
    def _has_reference(self) -> RigidInterfaceTable:
        if self.position is None:
            exactly_one(self, ("reference", "position"))
        return self


class DistributingInterfaceTable(_Referenced):
    """A reference node follows the mean motion of a group and spreads its forces over it (RBE3)."""

    kind: Literal["distributing"]
    """Selects this connection: a distributing one."""
    weights: list[Plain] | None = None
    """Weights of the nodes, in the order of their numbers. Default: equal."""

    @model_validator(mode="after")
    def _has_reference(self) -> DistributingInterfaceTable:
        if self.position is None:
            exactly_one(self, ("reference", "position"))
        return self


class TermTable(Table):
    """A component of the one node of a group, times a factor."""

    group: str
    """Mesh group of one node."""
    component: Component
    """Displacement x, y, z or rotation rx, ry, rz, in axes of the body."""
    factor: Plain
    """Factor of the component: a pure number, or metres per radian in SI where the equation mixes them."""


class EquationTable(Table):
    """A sum of components of nodes that is zero (MPC)."""

    kind: Literal["equation"]
    """Selects this connection: an equation of components."""
    terms: Annotated[list[TermTable], Field(min_length=1)]
    """Terms that add up to zero. The first one's component follows the others."""


Connection = Annotated[RigidInterfaceTable | DistributingInterfaceTable | EquationTable, Field(discriminator="kind")]


class RegionTable(Table):
    """A group of the mesh by place or number."""

    box: tuple[Position, Position] | None = None
    """Two opposite corners of a box, in the body frame: all points in it, and the cells between them."""
    nearest: Position | None = None
    """The mesh point nearest to this position in the body frame."""
    points: Annotated[list[Whole], Field(min_length=1)] | None = None
    """Points by number, from 1 in the order of the mesh file."""
    within: str | None = None
    """Mesh group whose points alone count, with box. Default: all points."""

    @model_validator(mode="after")
    def _one_definition(self) -> RegionTable:
        exactly_one(self, ("box", "nearest", "points"))
        return self
