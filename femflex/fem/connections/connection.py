"""What a connection is: dofs that follow others, over nodes of groups and a reference node."""

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

Place = tuple[float, float, float]

REFERENCE = "{} reference"  # point group of a reference node made at a position, of the group it is for


class Connection(Protocol):
    """Dependent dofs of a body; a new kind is one new file with a class of this form."""

    def placed(self, mesh: Mesh) -> Mesh:
        """The mesh with the nodes the connection brings with it."""

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """The dofs that follow others, after the members have numbered theirs."""


def with_reference(mesh: Mesh, reference: str | Place, group: str, name: str) -> Mesh:
    """The mesh with a node at a reference given by its position, alone in the point group of `reference_group`."""
    if isinstance(reference, str):
        return mesh
    at = np.asarray(reference, float)
    own = reference_group(reference, group, name)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise ValueError(f"reference of the connection to group {group!r} is {reference!r}; give a group or a position")
    return with_point_at(mesh, own, at)


def reference_group(reference: str | Place, group: str, name: str) -> str:
    """The point group of the reference node."""
    return reference if isinstance(reference, str) else name or REFERENCE.format(group)


def reference_node(mesh: Mesh, reference: str | Place, group: str, name: str) -> int:
    """The one node of the reference; ValueError where its group has several."""
    own = reference_group(reference, group, name)
    nodes = mesh.group_points(own)
    if len(nodes) != 1:
        raise ValueError(
            f"reference {own!r} of the connection to group {group!r} has {len(nodes)} nodes; name a group of one node, "
            "or give a position"
        )
    return int(nodes[0])


def skew(r: Array) -> Array:
    """Cross-product matrices (..., 3, 3) of vectors r (..., 3) in any unit: skew(r) a = r x a."""
    return np.asarray(np.cross(r[..., None, :], np.eye(3)).swapaxes(-1, -2))
