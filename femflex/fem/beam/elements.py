"""The elements of a beam member: their geometry and axes, the motion by their dofs, and sections along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from femflex.arrays import Array, IntArray
from femflex.fem.beam.shapes import NODAL, BeamOrder, field_rows, shear_rows
from femflex.fem.line.chain import LINE_TYPES, ArcLength, element_frames, straight_elements
from femflex.fem.mesh_warnings import UNLIKE_STIFFNESSES, UPRIGHT_AXIS
from femflex.fem.sections.section import Resultants
from femflex.warning import warn_of_physics

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


@dataclass(frozen=True, eq=False)
class BeamElements:
    """Geometry and dofs of a member's elements.

    nodes (e, 2), origin (e, 3), length (e,), frame (e, 3, 3) rows x, y, z; dofs (e, n_local); arc: arc length along
    the member
    """

    nodes: IntArray
    origin: Array
    length: Array
    frame: Array
    dofs: IntArray
    arc: ArcLength
    order: BeamOrder

    def rows(self, xi: Array, derivative: int = 0) -> Array:
        """Shape functions (e, q, 4, n_local) of u, v, w [m per dof] and theta [rad per dof] at xi (q,), element axes.

        Columns are the element's dofs in global axes: translations [m], rotations [rad], amplitudes of bubbles [m].
        """
        rows = field_rows(self.order, xi, self.length, derivative)
        for node in range(0, NODAL, 3):
            rows[..., node : node + 3] = np.matmul(rows[..., node : node + 3], self.frame[:, None])
        return rows

    def slopes(self, xi: Array, derivative: int = 0) -> Array:
        """Slopes of sections v' - gamma_y and w' - gamma_z (e, q, 2, n_local) [rad per dof], or their d/dx [1/m]."""
        return self.rows(xi, derivative + 1)[:, :, 1:3] - shear_rows(self.order, xi, self.length, derivative)

    def shears(self, xi: Array) -> Array:
        """Shear strains gamma_y and gamma_z (e, q, 2, n_local) [rad per dof]."""
        return shear_rows(self.order, xi, self.length, 0)

    def positions(self, xi: Array, offsets: Array) -> Array:
        """Undeformed positions (e, q, k, 3) [m] at offsets (e, q, k, 3) from the line, section axes, at xi (q,)."""
        axis = self.origin[:, None] + self.length[:, None, None] * xi[:, None] * self.frame[:, None, 0]
        return axis[:, :, None] + np.matmul(offsets, self.frame[:, None])

    def motion(self, xi: Array, offsets: Array) -> Array:
        """Rows of the global displacement u + (theta, -w', v') x offset of such points: (e, q, k, 3, n_local) [SI per
        dof]."""
        rows, slope = self.rows(xi), self.slopes(xi)
        x, y, z = (offsets[..., i, None] for i in range(3))
        u, v, w, theta = (rows[:, :, None, i] for i in range(4))
        dv, dw = slope[:, :, None, 0], slope[:, :, None, 1]
        local = np.stack([u - y * dv - z * dw, v - z * theta + x * dv, w + y * theta + x * dw], axis=-2)
        return np.matmul(self.frame.swapaxes(1, 2)[:, None, None], local)

    def turn(self, xi: Array) -> Array:
        """Rows of the global rotation (theta, -w', v') of sections (e, q, 3, n_local)."""
        rows, slope = self.rows(xi), self.slopes(xi)
        local = np.stack([rows[:, :, 3], -slope[:, :, 1], slope[:, :, 0]], axis=2)
        return np.matmul(self.frame.swapaxes(1, 2)[:, None], local)


def stations(elements: BeamElements, member: Member, degree: int) -> tuple[Array, Array, Resultants]:
    """Return Gauss points xi (q,), the lengths that they represent (e, q) [m], and the section's resultants there (e,
    q)."""
    points, weights = get_quadrature(RefLine, degree)
    s = elements.arc.arc_at(points[0])
    try:
        resultants = member.section.resultants(member.material, s, elements.arc.whole[:, None])
    except ValueError as error:
        raise ValueError(f"beam on group {member.group!r}: {error}") from None
    return points[0], elements.length[:, None] * weights, resultants


# Axes of beam sections without an orientation vector: they are reported, with a warning where the default is a poor
# guess.


CENTRES = ("offset", "shear_centre", "mass_centre")
SAME = 1e-6  # of unit vectors


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
        warn_of_physics(
            "beam on group {body_or_joint!r} has no orientation, {matter}, and {value} of its {count} elements run "
            "along the mesh's z axis: the section's y axis is selected along {first} there.",
            body_or_joint=member.group,
            value=int(vertical.sum()),
            remedy="Give the option orientation, a direction near the section's y axis",
            matter=matter,
            count=len(y),
            first=first,
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
