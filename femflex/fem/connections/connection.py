"""Connections: dofs that follow others, over the nodes of groups and a reference node."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, Protocol, Self

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.mesh.regions import with_point_at
from femflex.noun.table import Table, exactly_one
from femflex.noun.values import Direction, Position

if TYPE_CHECKING:
    from femflex.mesh import Mesh

Component = Literal["x", "y", "z", "rx", "ry", "rz"]
Axes = tuple[Direction, Direction, Direction]
REFERENCE = "{} reference"  # name of the point group of a reference node that is made at a position


class Connection(Protocol):
    """Dependent dofs of a body; a new kind is one new file with a class of this form."""

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """The mesh with the node that the connection adds, if it adds one."""

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """The dofs that follow others, after the members have numbered theirs."""


class Referenced(Table):
    """A connection of the nodes of a group with one reference node.

    In Python `reference` may also be a position (3,) [m], and `name` the name of the node that is made there.
    """

    @classmethod
    def from_python(cls, keys: dict[str, Any]) -> dict[str, Any]:
        """The keys, a position and its name as in case files."""
        name, reference = keys.pop("name", ""), keys.get("reference")
        if reference is not None and not isinstance(reference, str):
            keys |= {"position": reference, "reference": name or None}
        return keys

    @model_validator(mode="after")
    def _has_reference(self) -> Self:
        if self.position is None:
            exactly_one(self, ("reference", "position"))
        return self

    if TYPE_CHECKING:  # keys of the subclasses, in the order of their arguments
        group: str
        reference: str | None
        position: Position | None

    @property
    def reference_group(self) -> str:
        """Group of the reference node."""
        return self.reference or REFERENCE.format(self.group)

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """The mesh with a node at a reference given by its position, alone in the point group `reference_group`."""
        return mesh if self.position is None else with_point_at(mesh, self.reference_group, self.position)

    def reference_node(self, mesh: Mesh) -> int:
        """The one node of the reference; ValueError where its group has several."""
        return only_node(mesh, self.reference_group, f"the connection to group {self.group!r}")


def only_node(mesh: Mesh, group: str, where: str) -> int:
    """The node of a group of one node; ValueError, with what needs it, where the group has several."""
    nodes = mesh.group_points(group)
    if len(nodes) != 1:
        raise ValueError(f"{where}: group {group!r} has {len(nodes)} nodes; name a group of one node")
    return int(nodes[0])


def skew(r: Array) -> Array:
    """Cross-product matrices (..., 3, 3) of vectors r (..., 3) in any unit: skew(r) a = r x a."""
    return np.asarray(np.cross(r[..., None, :], np.eye(3)).swapaxes(-1, -2))
