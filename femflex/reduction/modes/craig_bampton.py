"""Craig–Bampton sets: constraint modes of named interfaces with fixed-interface vibration modes.

R. R. Craig and M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313–1319.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy import linalg

from femflex.arrays import Array, IntArray
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import Groups, held_dofs, independent_columns, names, rigid_shapes
from femflex.reduction.modes.vibration import ModeSet, fixed_modes, rigid_set, ritz, statically_condensed


def craig_bampton(
    structure: Structure,
    interfaces: str | Sequence[str],
    n: int,
    clamp: Groups = (),
    interface: Literal["rigid", "nodal"] = "rigid",
    orthonormal: bool = True,
    reference: str | None = None,
) -> ModeSet:
    """Constraint modes of the interface groups and the n lowest modes with all interfaces fixed.

    interface    "rigid": the nodes of a group move as one rigid body, six shapes a group (exact for a single node; a
                 stiff fitting for an edge or a face); "nodal": every dof of every interface node has its own shape.
    clamp        groups fixed in the body frame. Without any, the first interface is the reference: its mean
                 displacement and rotation are removed from the shapes, so that it stays with the body frame.
    reference    group of interface nodes that is the reference instead of the first interface: that of both ends of a
                 beam makes the frame follow its chord.
    orthonormal  the shapes are recombined into the modes of the reduced problem, M-orthonormal with their omega;
                 otherwise constraint modes (unit interface motions) come first, vibration modes after.
    n = 0 is static condensation. Raises ValueError if the shapes would contain a motion without stiffness.
    """
    groups = names(interfaces)
    if not groups:
        raise ValueError("a Craig–Bampton set needs at least one interface group; name one, or use cantilever modes.")
    clamped = held_dofs(structure, clamp)
    boundary = np.setdiff1d(held_dofs(structure, groups), clamped)
    reference_group = None if clamped.size else reference or groups[0]
    nodes = np.concatenate([structure.mesh.group_points(group) for group in groups])
    if reference_group is not None and not np.isin(structure.mesh.group_points(reference_group), nodes).all():
        raise ValueError(
            f"reference {reference_group!r} has nodes that belong to no interface ({', '.join(groups)}); give a group "
            "of interface nodes."
        )
    motions = _interface_motions(structure, groups, boundary, interface, reference_group)
    all_groups = tuple(dict.fromkeys((*names(clamp), *groups)))
    fixed = np.union1d(clamped, boundary)
    vibration = fixed_modes(structure, fixed, all_groups, n) if n else rigid_set(structure.n_dof)
    constraint = statically_condensed(structure, clamped, boundary, motions)
    phi = np.column_stack([constraint, vibration.phi])
    kinds = ("constraint",) * constraint.shape[1] + vibration.kinds
    omega = np.append(np.full(constraint.shape[1], np.nan), vibration.omega)
    if orthonormal and constraint.shape[1]:
        omega, phi = ritz(structure, phi)
        kinds = ("craig-bampton",) * len(omega)
    return ModeSet(phi, kinds, omega, all_groups, clamped, vibration.note, reference_group or "")


def _interface_motions(
    structure: Structure, groups: tuple[str, ...], boundary: IntArray, interface: str, reference: str | None
) -> Array:
    """Independent motions (n_boundary, k) of the interface dofs, without the mean motion of the reference group."""
    if interface == "nodal":
        motions = np.eye(len(boundary))
    elif interface == "rigid":
        _check_apart(structure, groups)
        motions = np.concatenate([_rigid_motions(structure, group, boundary) for group in groups], axis=1)
    else:
        raise ValueError(f"interface is {interface!r}; it is 'rigid' or 'nodal'.")
    return motions if reference is None else _without_motion_of(structure, reference, boundary, motions)


def _check_apart(structure: Structure, groups: tuple[str, ...]) -> None:
    """Raise ValueError if two rigid interfaces share a node."""
    for i, group in enumerate(groups):
        for neighbour in groups[i + 1 :]:
            shared = np.intersect1d(structure.mesh.group_points(group), structure.mesh.group_points(neighbour))
            if shared.size:
                raise ValueError(
                    f"rigid interfaces {group!r} and {neighbour!r} share {shared.size} nodes, so neither could move "
                    "alone; make groups apart from each other, or choose nodal interfaces."
                )


def _rigid_motions(structure: Structure, group: str, boundary: IntArray) -> Array:
    """Motions (n_boundary, k <= 6) in which the group's own dofs move as one rigid piece about its mean position."""
    in_group = np.isin(boundary, structure.clamped_dofs(group))
    centre = structure.mesh.points[structure.mesh.group_points(group)].mean(axis=0)
    R = np.zeros((len(boundary), 6))
    R[in_group] = rigid_shapes(structure, about=centre)[boundary[in_group]]
    return R[:, independent_columns(R)]


def _without_motion_of(structure: Structure, group: str, boundary: IntArray, motions: Array) -> Array:
    """Combinations of motions in which the group's mean displacement and rotation vanish.

    Raises ValueError if the group cannot define the body frame (one node without rotation, or nodes on one line).
    """
    rows = marker_rows(structure, group)
    translation_and_rotation = np.concatenate([rows.translation.toarray(), rows.rotation.toarray()])
    if len(independent_columns(translation_and_rotation @ rigid_shapes(structure, about=rows.position))) < 6:
        raise ValueError(
            f"interface {group!r} cannot hold the body frame: its nodes show fewer than six rigid motions. "
            "Put an interface with rotations, or with nodes off one line, first; or clamp a group."
        )
    mean_motion = translation_and_rotation[:, boundary] @ motions
    mean_motion /= np.linalg.norm(mean_motion, axis=1, keepdims=True)
    involved = mean_motion.any(axis=0)
    unchanged = np.eye(motions.shape[1])[:, ~involved]
    null = linalg.null_space(mean_motion[:, involved], rcond=1e-9)
    moving = np.zeros((motions.shape[1], null.shape[1]))
    moving[involved] = null
    return motions @ np.concatenate([moving, unchanged], axis=1)
