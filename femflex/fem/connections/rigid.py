"""Rigid interfaces: nodes of a group move with a reference node as one rigid piece (Nastran's RBE2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import Position, reference_node, skew, with_reference
from femflex.fem.support import COMPONENTS, GLOBAL, Rows, Support

if TYPE_CHECKING:
    from femflex.mesh import Mesh


@dataclass(frozen=True)
class Rigid:
    """The nodes of a group follow a reference node: u = u_0 + theta_0 x (x - x_0), theta = theta_0.

    group       its nodes follow
    reference   group of one node, or a position (3,) [m] where a node is made
    components  of "x", "y", "z", "rx", "ry", "rz" that follow, along the rows of axes (3, 3)
    name        of the point group of a node made at a position; "GROUP reference" when left out
    """

    group: str
    reference: str | Position
    components: tuple[str, ...] = COMPONENTS
    axes: Rows = GLOBAL
    name: str = ""

    def __post_init__(self) -> None:
        Support(self.components, self.axes)  # checks both
        if not self.components:
            raise ValueError(f"the rigid connection of group {self.group!r} has no components; name some")

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """See Connection."""
        return with_reference(mesh, self.reference, self.group, self.name)

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """See Connection."""
        to = self.name or (self.reference if isinstance(self.reference, str) else "")
        where = f"the rigid connection of group {self.group!r}" + (f" to {to!r}" if to else "")
        centre = reference_node(mesh, self.reference, self.group, self.name)
        nodes = mesh.group_points(self.group)
        nodes = nodes[nodes != centre]
        if not len(nodes):
            raise ValueError(f"{where} has no nodes besides its reference; name a group that has")
        reference_nodes = np.array([centre])
        source = np.concatenate([numbering.translation(reference_nodes)[0], numbering.rotation(reference_nodes)[0]])
        loose_nodes = nodes[numbering.translation_of(nodes)[:, 0] < 0]
        if len(loose_nodes):  # nodes without a member move with the reference
            numbering.translation(loose_nodes)
            numbering.rotation(loose_nodes)
        support = Support(self.components, self.axes)
        rows, keep = np.asarray(support.axes), np.array([c in self.components for c in COMPONENTS])
        arms = mesh.points[nodes] - mesh.points[centre]
        dependences = []
        for r, move, turn in zip(arms, numbering.translation_of(nodes), numbering.rotation_of(nodes), strict=True):
            if keep[:3].any():
                M = np.concatenate([np.eye(3), -skew(r)], axis=1)
                dependences.append(Dependence(move, rows[keep[:3]], source, M, where))
            if keep[3:].any() and turn[0] >= 0:
                M = np.concatenate([np.zeros((3, 3)), np.eye(3)], axis=1)
                dependences.append(Dependence(turn, rows[keep[3:]], source, M, where))
        return dependences
