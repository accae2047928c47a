"""Markers: the translation and small rotation of a named point, as rows on a Structure's dofs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.body import Marker
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import rigid_motion
from femflex.warning import warn_of_physics

FLAT = 1e-10  # relative second moment of a group's nodes about an axis below which they cannot show a rotation about it


@dataclass(frozen=True, eq=False)
class MarkerRows:
    """Mean position (3,) of a group's nodes, and its translation and rotation rows (3, n_dof).

    blind (3, k): unit axes about which the group shows no rotation; the rotation rows are zero about them. Of one node
    of a flat plate that is the normal.
    turning: whether its nodes have rotations of their own.
    """

    position: Array
    translation: sparse.csr_array
    rotation: sparse.csr_array
    blind: Array
    turning: bool


def marker_rows(structure: Structure, group: str) -> MarkerRows:
    """The rows of the marker at a mesh group.

    One node: its own translation and rotation. Several: the mean displacement and the unweighted least-squares
    rotation of the nodes about their mean position, theta = (sum |d|^2 1 - d d^T)^-1 sum d x u; about an axis they
    all lie on, the mean of the nodes' own rotations, if they have any. Midside nodes that carry no dofs (plates have
    theirs at the corners) are left out.
    """
    nodes = attachable_nodes(structure, group)
    position = structure.mesh.points[nodes].mean(axis=0)
    d = structure.mesh.points[nodes] - position
    rows = (3 * nodes[:, None] + np.arange(3)).ravel()
    u, theta = structure.translation[rows], structure.rotation[rows]
    fit, hidden = rotation_fit(d)
    turns = np.diff(theta.indptr).reshape(-1, 3).any(axis=1).astype(float)  # 1 for each node that has a rotation
    own = sparse.csr_array(hidden @ hidden.T @ mean_rows(turns)) @ theta
    return MarkerRows(
        position=position,
        translation=(sparse.csr_array(mean_rows(np.ones(len(nodes)))) @ u).tocsr(),
        rotation=(sparse.csr_array(fit) @ u + own).tocsr(),
        blind=_hidden_axes(hidden, own),
        turning=bool(theta.nnz),
    )


def attachable_nodes(structure: Structure, group: str) -> IntArray:
    """Numbers (k,) of the nodes of a group, without midside nodes that carry no dofs; ValueError when others carry
    none."""
    named = structure.mesh.group_points(group)
    carries = np.diff(structure.translation.indptr).reshape(-1, 3).sum(axis=1) > 0
    nodes = named if carries[named].all() else named[carries[named] | ~np.isin(named, structure.mesh.midside_points())]
    if not len(nodes) or not carries[nodes].all():
        raise ValueError(
            f"{np.count_nonzero(~carries[named])} of the {len(named)} nodes of group {group!r} belong to no member, or "
            "are midside nodes of plate elements, so nothing can be attached there; name a group with corner nodes of "
            "a member."
        )
    return nodes


def marker(rows: MarkerRows, phi: Array, name: str, turning: bool = True) -> Marker:
    """The Marker with these rows on shapes phi (n_dof, n), axes along the body frame.

    Warns, if its rotation will be used, when the marker moves but shows no rotation about some axis (nodes of solids
    have none). A rotation about the normal of a plate is not warned of: nodes of plates lack it, and plates are stiff
    in it.
    """
    translation, rotation = rows.translation @ phi, rows.rotation @ phi
    if turning and rows.blind.size and not rows.turning and np.abs(translation).max(initial=0.0) > 0:
        warn_of_physics(
            f"marker {name!r} shows no rotation about {rows.blind.shape[1]} of 3 axes: its nodes have no rotation and "
            "lie on one point or line. A joint at this marker does not turn about those axes, and a torque about them "
            "does not bend the body; name a group of nodes around the place."
        )
    return Marker(rows.position, translation, rotation)


def _hidden_axes(hidden: Array, own: sparse.csr_array) -> Array:
    """The axes among the hidden ones (3, k) about which the nodes' own rotations (3, n_dof) vanish too."""
    rows = hidden.T @ own if own.nnz else np.zeros((hidden.shape[1], 1))
    shown, axes = np.linalg.eigh(rows @ rows.T)
    return hidden @ axes[:, shown < FLAT]


def rotation_fit(d: Array) -> tuple[Array, Array]:
    """Least-squares rotation (3, 3 n) of nodes at d (n, 3) from their mean, and unit axes (3, k) it cannot see."""
    moment, axes = np.linalg.eigh((d**2).sum() * np.eye(3) - d.T @ d)
    seen = moment > FLAT * max(moment[-1], np.finfo(float).tiny)
    arms = rigid_motion(d)[0][:, :, 3:].reshape(-1, 3)  # u = arms theta in a rigid rotation
    return (axes[:, seen] / moment[seen]) @ axes[:, seen].T @ arms.T, axes[:, ~seen]


def mean_rows(weight: Array) -> Array:
    """Row operator (3, 3 n) [1] of the weighted mean over nodes."""
    return np.kron(weight / max(weight.sum(), 1.0), np.eye(3))
