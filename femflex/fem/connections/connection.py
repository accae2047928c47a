"""Connections: dofs that follow others, over the nodes of groups and a reference node."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from femflex.arrays import Array
from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.mesh.regions import with_point_at

if TYPE_CHECKING:
    from femflex.mesh import Mesh

Position = tuple[float, float, float]

REFERENCE = "{} reference"  # name of the point group of a reference node that is made at a position


class Connection(Protocol):
    """Dependent dofs of a body; a new kind is one new file with a class of this form."""

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """The mesh with the node that the connection adds, if it adds one."""

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """The dofs that follow others, after the members have numbered theirs."""


def with_reference(mesh: Mesh, reference: str | Position, group: str, name: str) -> Mesh:
    """The mesh with a node at a reference given by its position, alone in the point group of `reference_group`."""
    if isinstance(reference, str):
        return mesh
    position = np.asarray(reference, float)
    group_name = reference_group(reference, group, name)
    if position.shape != (3,) or not np.isfinite(position).all():
        raise ValueError(f"reference of the connection to group {group!r} is {reference!r}; give a group or a position")
    return with_point_at(mesh, group_name, position)


def reference_group(reference: str | Position, group: str, name: str) -> str:
    """The point group of the reference node."""
    return reference if isinstance(reference, str) else name or REFERENCE.format(group)


def reference_node(mesh: Mesh, reference: str | Position, group: str, name: str) -> int:
    """The one node of the reference; ValueError where its group has several."""
    group_name = reference_group(reference, group, name)
    nodes = mesh.group_points(group_name)
    if len(nodes) != 1:
        raise ValueError(
            f"reference {group_name!r} of the connection to group {group!r} has {len(nodes)} nodes; name a group of "
            "one node, or give a position"
        )
    return int(nodes[0])


def skew(r: Array) -> Array:
    """Cross-product matrices (..., 3, 3) of vectors r (..., 3) in any unit: skew(r) a = r x a."""
    return np.asarray(np.cross(r[..., None, :], np.eye(3)).swapaxes(-1, -2))
