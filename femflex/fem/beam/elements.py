"""The elements of a beam member: their geometry, the motion by their dofs, and the section at points along them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from femflex.arrays import Array, IntArray
from femflex.fem.beam.shapes import NODAL, BeamOrder, field_rows, shear_rows
from femflex.fem.line.chain import ArcLength
from femflex.fem.sections.section import Resultants

if TYPE_CHECKING:
    from femflex.fem.structure import Member


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
