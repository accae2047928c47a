"""Rigid interfaces, u = u_0 + theta_0 x (x - x_0), theta = theta_0: Nastran's RBE2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import Axes, Component, Referenced, skew
from femflex.fem.support import COMPONENTS, GLOBAL, Support
from femflex.noun.table import refuse
from femflex.noun.values import Position

if TYPE_CHECKING:
    from femflex.mesh import Mesh


class Rigid(Referenced):
    """The nodes of a group move with a reference node as one rigid piece (RBE2)."""

    kind: Literal["rigid"] = "rigid"
    """Selects this connection: a rigid one."""
    group: str
    """Mesh group whose nodes are connected."""
    reference: str | None = None
    """Mesh group of the one reference node; with position, the name that a new node gets. Markers, clamps and point
    masses may name it. Default: named after the group."""
    components: Annotated[tuple[Component, ...], Field(min_length=1)] = ("x", "y", "z", "rx", "ry", "rz")
    """Components of the nodes that follow the reference."""
    axes: Axes = GLOBAL
    """Axes of the components: three directions at right angles. Default: those of the body."""
    position: Position | None = None
    """Position of a new reference node in the body frame. Default: the node of the group `reference`."""

    @model_validator(mode="after")
    def _axes_fit(self) -> Rigid:
        try:
            Support(self.components, self.axes)
        except ValueError as error:
            refuse(str(error))
        return self

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """See Connection."""
        where = f"the rigid connection of group {self.group!r}" + (f" to {self.reference!r}" if self.reference else "")
        centre = self.reference_node(mesh)
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
