"""Connections, dofs that follow others: rigid and distributing ones of groups with a reference node."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, Self

import numpy as np
from pydantic import Field, model_validator

from femflex.arrays import Array
from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.support import COMPONENTS, GLOBAL, Support
from femflex.mesh.regions import with_point_at
from femflex.noun.table import Table, exactly_one, refuse
from femflex.noun.values import Direction, Plain, Position

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
