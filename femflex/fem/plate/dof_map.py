"""Local dofs of flat plate elements from their raw dofs, and the quantities all flat elements share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.plate.blocks import LocalDofs
from femflex.fem.plate.sides import Sides, element_sides
from femflex.fem.sections.laminates import PlateSection, isotropic
from femflex.fem.sections.materials import Material

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


def member_section(member: Member, coupled: bool = False) -> PlateSection:
    """Return the member's plate section: the given section, or that of a plain sheet of a thickness [m] and the
    member's material.

    coupled: whether the family accepts sections that couple membrane and bending. Raises ValueError if it is neither.
    """
    section, material, where = member.section, member.material, f"{member.family} on group {member.group!r}"
    if isinstance(section, PlateSection):
        if material is not None:
            raise ValueError(f"{where} has a material and a section with its own material; leave one out")
        if section.coupled and not coupled:
            raise ValueError(
                f"{where} has a section that couples membrane and bending, or lies off its nodes; use the family shell"
            )
        return section
    if isinstance(section, int | float | np.floating) and not isinstance(section, bool):
        if not isinstance(material, Material):
            raise ValueError(f"{where} has a thickness but no isotropic material; give one, or a section of plies")
        return isotropic(float(section), material)
    raise ValueError(
        f"{where} has the section {section!r}; give a plate section of femflex.fem.sections.laminates, or a thickness "
        "in metres and a material"
    )


def flat_map(
    mesh: Mesh, corners: IntArray, axes: Array, numbering: Numbering, element_dofs: Array | None = None
) -> LocalDofs:
    """Return the map of elements with corners (e, c) and axes (1|e, 3, 3), rows e1, e2, normal.

    Raw dofs: translations and rotations of the corners, two per side, then element_dofs (e, c + 2): a twist per corner
    and an in-plane bubble. Local: (u, v) of corners, sides (and bubble), then (w, theta_x, theta_y (, twist)) of
    corners.
    """
    e, c = corners.shape
    normals = np.broadcast_to(axes[:, 2], (e, 3))
    nodal = [
        numbering.translation(corners.ravel()),
        numbering.rotation(corners.ravel(), np.repeat(normals, c, axis=0)),
    ]
    sides = element_sides(mesh, corners, axes, numbering)
    dofs = np.concatenate([d.reshape(e, -1) for d in (*nodal, sides.dofs)], axis=1)
    if element_dofs is not None:
        dofs = np.concatenate([dofs, element_dofs], axis=1)
    m = 2 * c + (element_dofs is not None)
    X = _plain_map(axes, c, element_dofs is not None)
    if sides.folds.any():
        X = np.array(np.broadcast_to(X, (e, *X.shape[1:])))
        _follow_folds(X, mesh.points[corners], np.broadcast_to(axes, (e, 3, 3)), sides)
    return LocalDofs(dofs, X, 2 * m)


def _plain_map(axes: Array, c: int, extended: bool) -> Array:
    """X (1|e, local, raw) of elements without folds."""
    m, b = 2 * c + extended, 3 + extended
    X = np.zeros((len(axes), 2 * m + b * c, 8 * c + (c + 2) * extended))
    for i in range(c):
        move, turn = slice(3 * i, 3 * i + 3), slice(3 * (c + i), 3 * (c + i) + 3)
        bend, side = 2 * m + b * i, 2 * (c + i)
        X[:, 2 * i : 2 * i + 2, move], X[:, bend, move] = axes[:, :2], axes[:, 2]
        X[:, bend + 1 : bend + 3, turn] = axes[:, :2]
        X[:, side : side + 2, 6 * c + 2 * i : 6 * c + 2 * i + 2] = np.eye(2)
        if extended:
            X[:, bend + 3, 8 * c + i] = 1.0
    if extended:
        X[:, 2 * m - 2 : 2 * m, 9 * c :] = np.eye(2)
    return X


def _follow_folds(X: Array, x: Array, axes: Array, sides: Sides) -> None:
    """Replace the rows of sides at folds in X (e, local, raw): free along the side, following rotations across it."""
    c = x.shape[1]
    for i in range(c):
        folded = np.flatnonzero(sides.folds[:, i])
        j = (i + 1) % c
        plane, along = axes[folded, :2], sides.along[folded, i]
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        span = x[folded, j] - x[folded, i]
        rotation_rows = plane @ across @ np.cross(np.eye(3), -span[:, None, :]) / 8
        for row, slot in ((2 * (c + i), 0), (2 * (c + i) + 1, 1)):
            X[folded, row] = 0.0
            X[folded, row, 6 * c + 2 * i] = np.sum(plane[:, slot] * along, axis=1)
            X[folded, row, 3 * (c + i) : 3 * (c + i) + 3] = rotation_rows[:, slot]
            X[folded, row, 3 * (c + j) : 3 * (c + j) + 3] = -rotation_rows[:, slot]
