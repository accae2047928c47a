"""Axes of beam sections without an orientation vector: they are reported, with a warning where the default is a poor
guess."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.fem.limits import UNLIKE_STIFFNESSES, UPRIGHT_AXIS
from femflex.fem.line.chain import LINE_TYPES, element_frames, straight_elements
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


SAME = 1e-6  # of unit vectors
CENTRES = ("offset", "shear_centre", "mass_centre")


def selected_axes(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh unchanged, and a sentence about each beam member whose section has axes but no orientation
    vector."""
    return mesh, tuple(
        text for member in members if member.family == "beam" and (text := _selected_axes_note(mesh, member))
    )


def _selected_axes_note(mesh: Mesh, member: Member) -> str:
    """Return the sentence about the axes selected for a member, or nothing; warn where elements run along the mesh's z
    axis."""
    if member.options.get("orientation") is not None or not (matter := _axes_reason(member)):
        return ""
    cells = {kind: mesh.cells[kind][rows] for kind, rows in mesh.cell_groups.get(member.group, {}).items()}
    nodes = straight_elements({kind: nodes_of_kind for kind, nodes_of_kind in cells.items() if kind in LINE_TYPES})
    if not len(nodes):
        return ""
    frame = element_frames(mesh.points[nodes[:, 0]], mesh.points[nodes[:, 1]], None, member.group)[1]
    vertical = np.linalg.norm(frame[:, 0, :2], axis=1) < UPRIGHT_AXIS
    y = frame[:, 1]
    first = _vector(y[np.argmax(vertical)])
    if vertical.any():
        warnings.warn(
            PhysicsWarning(
                "beam on group {body_or_joint!r} has no orientation, {matter}, and {value} of its {count} elements run "
                "along the mesh's z axis: the section's y axis is selected along {first} there.",
                body_or_joint=member.group,
                value=int(vertical.sum()),
                remedy="Give the option orientation, a direction near the section's y axis",
                matter=matter,
                count=len(y),
                first=first,
            ),
            stacklevel=5,
        )
        return ""
    direction = f"along {first}" if np.abs(y - y[0]).max() < SAME else "across the mesh's z axis, element by element"
    return f"beam on group {member.group!r} has no orientation, {matter}: the section's y axis is selected {direction}"


def _axes_reason(member: Member) -> str:
    """Return the reason why the direction of the section's axes matters; empty if it does not, or the section is not
    one of beams."""
    if any(member.options.get(name) is not None and np.any(member.options[name]) for name in CENTRES):
        return "its section has centres off the nodes"
    if not hasattr(member.section, "resultants"):
        return ""
    try:
        r = member.section.resultants(member.material, np.zeros(1), np.ones(1))
    except ValueError:
        return ""  # the family reports the error
    if r.coupled is not None:
        return "its section couples stretch, shear, twist and bending"
    ratio = float(np.max(r.EIz / r.EIy))
    return f"EIz is {ratio:.4g} times EIy" if abs(ratio - 1) > UNLIKE_STIFFNESSES else ""


def _vector(direction: Array) -> str:
    return f"({', '.join(f'{c:.4g}' for c in direction + 0.0)})"
