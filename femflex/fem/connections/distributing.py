"""Distributing interfaces: a reference node follows the mean motion of a group, without stiffening it (RBE3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import Position, reference_node, skew, with_reference

if TYPE_CHECKING:
    from femflex.mesh import Mesh

FLAT = 1e-9  # least over largest moment of the nodes about their centre, below which they lie on a line


@dataclass(frozen=True)
class Distributing:
    """A reference node follows the rigid motion that fits the translations of a group's nodes best.

    With weights w, centre c = sum w x / sum w and J = sum w (|r|^2 - r r^T), r = x - c:
    theta = J^-1 sum w r x u, u_0 = sum w u / sum w + theta x (x_0 - c). Forces on the reference are spread over the
    nodes by these weights; the group is not stiffened.

    group      nodes that lead
    reference  group of one node, or a position (3,) [m] where a node is made; it follows
    weights    of the nodes in the order of the group's node numbers; equal when left out
    name       of the point group of a node made at a position; "GROUP reference" when left out
    """

    group: str
    reference: str | Position
    weights: tuple[float, ...] | None = None
    name: str = ""

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """See Connection."""
        return with_reference(mesh, self.reference, self.group, self.name)

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """See Connection."""
        where = f"the distributing connection of group {self.group!r}"
        centre = reference_node(mesh, self.reference, self.group, self.name)
        nodes = mesh.group_points(self.group)
        nodes = nodes[nodes != centre]
        moves = numbering.translation_of(nodes)
        if not len(nodes) or (moves < 0).any():
            raise ValueError(
                f"{where} has {len(nodes)} nodes, {int((moves[:, 0] < 0).sum())} of them on no member; name a group "
                "that lies on members"
            )
        w = np.ones(len(nodes)) if self.weights is None else np.asarray(self.weights, float)
        if w.shape != (len(nodes),) or not np.isfinite(w).all() or (w < 0).any() or not w.any():
            raise ValueError(f"{where} has {w.size} weights for {len(nodes)} nodes; give one, not negative, for each")
        w = w / w.sum()
        x = mesh.points[nodes]
        c = w @ x
        r = x - c
        J = np.einsum("n,ni,ni->", w, r, r) * np.eye(3) - np.einsum("n,ni,nj->ij", w, r, r)
        reference_nodes = np.array([centre])
        source = moves.ravel()
        value = np.linalg.eigvalsh(J)
        if value[0] <= FLAT * max(value[-1], np.finfo(float).tiny):
            raise ValueError(
                f"{where}: its {len(nodes)} nodes lie on a line or at one point, so their translations do not "
                "determine a rotation; name nodes off one line, or use a rigid connection"
            )
        turn = np.linalg.solve(J, np.concatenate(list(w[:, None, None] * skew(r)), axis=1))  # (3, 3 n)
        move = np.concatenate([weight * np.eye(3) for weight in w], axis=1) - skew(mesh.points[centre] - c) @ turn
        return [
            Dependence(numbering.translation(reference_nodes)[0], np.eye(3), source, move, where),
            Dependence(numbering.rotation(reference_nodes)[0], np.eye(3), source, turn, where),
        ]
