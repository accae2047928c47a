"""Springs and bushings inside a structure: between two nodes, to the body frame, or on sums of components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import only_node, skew
from femflex.fem.family import Contribution, SkinPart
from femflex.fem.support import COMPONENTS, Support
from femflex.fem.tables import DenseStrain
from femflex.noun.table import Table, refuse
from femflex.noun.values import Direction, Position, Quantity, Vector

if TYPE_CHECKING:
    from femflex.mesh import Mesh

SQUARE = 1e-6  # cosine between two axes that passes for rounding
APART = 1e-9  # of the mesh's size: distance of two nodes below which they coincide


class Bushing(Table):
    """A spring or bushing between two nodes of a body, or between a node and the body frame."""

    group: str
    """Group of one node."""
    to: str | None = None
    """Group of the other node. Default: the body frame."""
    translation: Annotated[Vector, Quantity("N/m", (3,), least=0.0)] = (0.0, 0.0, 0.0)
    """Stiffnesses against relative displacement along the axes."""
    rotation: Annotated[Vector, Quantity("N m", (3,), least=0.0)] = (0.0, 0.0, 0.0)
    """Stiffnesses against relative rotation about the axes, per radian."""
    axes: tuple[Direction, Direction, Direction] | None = None
    """Directions of the three axes in the body frame, at right angles. Default: the first from the node towards the
    other one; the body frame's where they coincide, and to the body frame."""
    at: Position | None = None
    """Where displacements are compared, in the body frame: each node takes that point along rigidly. Default: in the
    middle between the nodes."""
    stiffness: Annotated[float, Quantity("N/m", above=0.0)] | None = None
    """Stiffness of a spring along the line between the two nodes, in place of translation, rotation, axes and at."""

    @model_validator(mode="after")
    def _one_form(self) -> Bushing:
        other_form = sorted(self.model_fields_set & {"translation", "rotation", "axes", "at"})
        if self.stiffness is not None and other_form:
            refuse(f"found stiffness together with {', '.join(other_form)}; give one form or the other")
        if self.stiffness is not None and self.to is None:
            refuse("found `stiffness` without `to`; a spring along a line needs its other node")
        if self.stiffness is not None:
            vars(self)["translation"] = (self.stiffness, 0.0, 0.0)
        if not (any(self.translation) or any(self.rotation)):
            refuse("found no stiffness; give stiffness, translation or rotation")
        if self.axes is not None:
            try:
                vars(self)["axes"] = Support(COMPONENTS, self.axes).axes
            except ValueError as error:
                refuse(f"bushing at group {self.group!r}: {error}")
        return self

    def contribution(self, mesh: Mesh, numbering: Numbering) -> Contribution:
        """Return the bushing's contribution to a structure; see `bushing_part`."""
        return bushing_part(mesh, self, numbering)


def spring(group: str, to: str, stiffness: float) -> Bushing:
    """A spring along the line between two nodes that are apart [N/m]."""
    return Bushing(group=group, to=to, stiffness=stiffness)


def bushing_part(mesh: Mesh, bushing: Bushing, numbering: Numbering) -> Contribution:
    """Return the strain and the skin (a line between the nodes) of a bushing.

    Raises ValueError for groups of several nodes, for nodes without a member, and where nodes without rotations would
    have to resist one, or be compared across the line between them.
    """
    where = f"bushing at group {bushing.group!r}"
    nodes = np.array([only_node(mesh, group, where) for group in (bushing.group, bushing.to) if group is not None])
    translation, rotation = numbering.translation_of(nodes), numbering.rotation_of(nodes)
    if (translation < 0).any():
        raise ValueError(f"{where}: a node of it belongs to no member; connect nodes that lie on members")
    x = mesh.points[nodes]
    span = x[-1] - x[0]
    length = float(np.linalg.norm(span))
    separate = length > APART * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    if bushing.axes is not None:
        axes = np.asarray(bushing.axes, float)
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
    translation_rows = [s * np.hstack([axes, -axes @ a]) for s, a in zip(signs, skew(arms), strict=True)]
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
            nodes = np.array([only_node(mesh, group, "a scalar spring")])
            node_dofs = (numbering.rotation_of if kind == "rotation" else numbering.translation_of)(nodes)[0]
            if node_dofs[0] < 0:
                raise ValueError(f"scalar spring at group {group!r}: no member gives the node a {kind}; name another")
            dofs.append(node_dofs)
            row.append(np.asarray(factors, float))
        G = np.concatenate(row)[None, None, None]
        elastic = np.full((1, 1, 1, 1), self.stiffness)
        strain = DenseStrain(np.concatenate(dofs)[None], np.ones((1, 1)), elastic, np.eye(1), np.zeros((1, 1, 1)), G)
        return Contribution((), (strain,))
