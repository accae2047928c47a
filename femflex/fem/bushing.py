"""Springs and bushings inside a structure: between two nodes, to the body frame, or on sums of components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, SkinPart
from femflex.fem.point_mass import cross_matrices
from femflex.fem.tables import DenseStrain

if TYPE_CHECKING:
    from femflex.mesh import Mesh

SQUARE = 1e-6  # cosine between two axes that passes for rounding
APART = 1e-9  # of the mesh's size: distance of two nodes below which they coincide
Direction = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Bushing:
    """A linear elastic connection with up to six stiffnesses along its own axes.

    group        point group of one node
    to           point group of the other node; None: the body frame
    translation  (3,) stiffnesses against relative displacement along the axes [N/m]
    rotation     (3,) stiffnesses against relative rotation about them [N m/rad]
    axes         (3, 3) rows: directions of x, y, z in mesh axes. None: x from the node towards the other one, y and z
                 across; the mesh's axes where they coincide and to the body frame
    at           (3,) where displacements are compared [m], in mesh axes. None: in the middle between the nodes

    The point is rigidly attached to each node, so that rigid motion takes no energy. A spring along the line between
    two nodes is translation = (k, 0, 0).
    """

    group: str
    to: str | None = None
    translation: ArrayLike = (0.0, 0.0, 0.0)
    rotation: ArrayLike = (0.0, 0.0, 0.0)
    axes: ArrayLike | None = None
    at: ArrayLike | None = None

    def __post_init__(self) -> None:
        where = f"bushing at group {self.group!r}"
        for name in ("translation", "rotation"):
            value = np.asarray(getattr(self, name), float)
            if value.shape != (3,) or not np.isfinite(value).all() or (value < 0).any():
                raise ValueError(f"{where} has {name} {value.tolist()}; give three stiffnesses, none negative")
        if not (np.any(self.translation) or np.any(self.rotation)):
            raise ValueError(f"{where} has no stiffness; give translation, rotation, or both")
        if self.at is not None:
            position = np.asarray(self.at, float)
            if position.shape != (3,) or not np.isfinite(position).all():
                raise ValueError(f"{where} has at = {position.tolist()}; give a place by three coordinates")
        if self.axes is not None:
            rows = np.asarray(self.axes, float)
            if rows.shape != (3, 3) or not np.isfinite(rows).all() or not np.linalg.norm(rows, axis=1).all():
                raise ValueError(
                    f"{where} has axes {rows.tolist()}; give three directions of three components, not zero"
                )
            unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
            if np.abs(unit @ unit.T - np.eye(3)).max() > SQUARE:
                raise ValueError(
                    f"{where} has axes {rows.tolist()}, which are not at right angles; give orthogonal ones"
                )

    def contribution(self, mesh: Mesh, numbering: Numbering) -> Contribution:
        """Return the bushing's contribution to a structure; see `bushing_part`."""
        return bushing_part(mesh, self, numbering)


def spring(group: str, to: str, stiffness: float) -> Bushing:
    """A spring along the line between two nodes that are apart [N/m]."""
    return Bushing(group, to, (stiffness, 0.0, 0.0))


def bushing_part(mesh: Mesh, bushing: Bushing, numbering: Numbering) -> Contribution:
    """Return the strain and the skin (a line between the nodes) of a bushing.

    Raises ValueError for groups of several nodes, for nodes without a member, and where nodes without rotations would
    have to resist one, or be compared across the line between them.
    """
    where = f"bushing at group {bushing.group!r}"
    nodes = np.array([_node(mesh, group, where) for group in (bushing.group, bushing.to) if group is not None])
    translation, rotation = numbering.translation_of(nodes), numbering.rotation_of(nodes)
    if (translation < 0).any():
        raise ValueError(f"{where}: a node of it belongs to no member; connect nodes that lie on members")
    x = mesh.points[nodes]
    span = x[-1] - x[0]
    length = float(np.linalg.norm(span))
    separate = length > APART * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    if bushing.axes is not None:
        rows = np.asarray(bushing.axes, float)
        axes = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    else:
        axes = axes_along(span / length) if separate else np.eye(3)
    k = np.concatenate([np.asarray(bushing.translation, float), np.asarray(bushing.rotation, float)])
    middle = x.mean(axis=0) if bushing.at is None else np.asarray(bushing.at, float)
    arms = middle - x if separate or bushing.at is not None else np.zeros_like(x)
    turns = bool(k[3:].any()) or turns_nodes(axes[k[:3] > 0], arms)
    if turns and (rotation < 0).any():
        action = "resist rotation" if k[3:].any() else "be compared off the line between them"
        raise ValueError(
            f"{where}: nodes without rotation (solids, tethers, membranes) cannot {action}; give stiffness along the "
            "line between them alone, or connect nodes of beams or plates"
        )
    signs = (1.0,) if bushing.to is None else (-1.0, 1.0)
    translation_rows = [s * np.hstack([axes, -axes @ a]) for s, a in zip(signs, cross_matrices(arms), strict=True)]
    rotation_rows = [s * np.hstack([np.zeros((3, 3)), axes]) for s in signs]
    G = np.concatenate([np.hstack(translation_rows), np.hstack(rotation_rows)])[k > 0]
    if turns:
        dofs = np.concatenate([translation, rotation], axis=1).reshape(1, -1)
    else:
        dofs, G = translation.reshape(1, -1), G.reshape(len(G), len(nodes), 2, 3)[:, :, 0].reshape(len(G), -1)
    n = len(G)
    strain = DenseStrain(
        dofs, np.ones((1, 1)), np.diag(k[k > 0])[None, None], np.eye(n), np.zeros((n, n, n)), G[None, None]
    )
    skin: Callable[[], SkinPart] | None = (
        partial(_line, x, translation) if separate and bushing.to is not None else None
    )
    return Contribution((), (strain,), skin)


def turns_nodes(axes: Array, arms: Array) -> bool:
    """Whether forces along any of the axes (m, 3) have moments about nodes, over arms (n, 3) from these [m]."""
    moments = np.linalg.norm(np.cross(axes[:, None], arms), axis=2)
    return bool((moments > SQUARE * np.linalg.norm(arms, axis=1).max()).any())


def _node(mesh: Mesh, group: str, where: str) -> int:
    nodes = mesh.group_points(group)
    if len(nodes) != 1:
        raise ValueError(f"{where}: group {group!r} has {len(nodes)} nodes; a bushing connects one node with another")
    return int(nodes[0])


def axes_along(x: Array) -> Array:
    """Return orthonormal rows, the first of them x (3,)."""
    y = np.cross(np.eye(3)[np.abs(x).argmin()], x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def _line(x: Array, translation: IntArray) -> SkinPart:
    """The line between the nodes."""
    return SkinPart(x, {"line": np.array([[0, 1]])}, np.arange(6), translation.ravel(), np.ones(6))


@dataclass(frozen=True)
class ScalarSpring:
    """A spring that resists one linear combination of displacements and rotations of nodes.

    terms      (group of one node, "translation" or "rotation", (3,) factors along the mesh's axes), ...
    stiffness  [N/m], [N] or [N m/rad], as the terms go; not zero

    Unlike a Bushing between nodes that are apart it may resist rigid rotation: it is the spring of a matrix.
    """

    terms: tuple[tuple[str, str, Direction], ...]
    stiffness: float

    def __post_init__(self) -> None:
        if not self.terms or not np.isfinite(self.stiffness) or self.stiffness == 0:
            raise ValueError(
                f"a scalar spring has {len(self.terms)} terms and stiffness {self.stiffness}; give terms and a finite "
                "stiffness other than 0"
            )

    def contribution(self, mesh: Mesh, numbering: Numbering) -> Contribution:
        """Return the strain of the spring. Raises ValueError for groups of several nodes and for a node without such
        dofs."""
        dofs, row = [], []
        for group, kind, factors in self.terms:
            nodes = mesh.group_points(group)
            if len(nodes) != 1:
                raise ValueError(
                    f"scalar spring at group {group!r}: it has {len(nodes)} nodes; name groups of one node"
                )
            node_dofs = (numbering.rotation_of if kind == "rotation" else numbering.translation_of)(nodes)[0]
            if node_dofs[0] < 0:
                raise ValueError(f"scalar spring at group {group!r}: no member gives the node a {kind}; name another")
            dofs.append(node_dofs)
            row.append(np.asarray(factors, float))
        G = np.concatenate(row)[None, None, None]
        elastic = np.full((1, 1, 1, 1), self.stiffness)
        strain = DenseStrain(np.concatenate(dofs)[None], np.ones((1, 1)), elastic, np.eye(1), np.zeros((1, 1, 1)), G)
        return Contribution((), (strain,))
