"""Distributing interfaces: a reference node follows the mean motion of a group, without stiffening it (RBE3)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import Referenced, skew
from femflex.noun.values import Plain, Position

if TYPE_CHECKING:
    from femflex.mesh import Mesh

FLAT = 1e-9  # least over largest moment of the nodes about their centre, below which they lie on a line


class Distributing(Referenced):
    """A reference node follows the mean motion of a group and spreads its forces over it (RBE3)."""

    kind: Literal["distributing"] = "distributing"
    """Selects this connection: a distributing one."""
    group: str
    """Mesh group whose nodes are connected."""
    reference: str | None = None
    """Mesh group of the one reference node; with position, the name that a new node gets. Markers, clamps and point
    masses may name it. Default: named after the group."""
    weights: tuple[Plain, ...] | None = None
    """Weights of the nodes, in the order of their numbers. Default: equal."""
    position: Position | None = None
    """Position of a new reference node in the body frame. Default: the node of the group `reference`."""

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """See Connection. The reference follows the rigid motion that fits the nodes' translations best.

        With weights w, centre c = sum w x / sum w and J = sum w (|r|^2 - r r^T), r = x - c:
        theta = J^-1 sum w r x u, u_0 = sum w u / sum w + theta x (x_0 - c).
        """
        where = f"the distributing connection of group {self.group!r}"
        centre = self.reference_node(mesh)
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
