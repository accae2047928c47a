"""The elements of a beam member: where they lie, what their dofs move, and the section at points along them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from femflex.fem.beam.shapes import NODAL, BeamOrder, field_rows
from femflex.fem.line.chain import ArcLength
from femflex.fem.sections.section import Resultants

if TYPE_CHECKING:
    from femflex.fem.structure import Member

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class BeamElements:
    """Geometry and dofs of a member's elements.

    origin (e, 3), length (e,), frame (e, 3, 3) rows x, y, z; dofs (e, n_local); arc: arc length along the member
    """

    origin: Array
    length: Array
    frame: Array
    dofs: Index
    arc: ArcLength
    order: BeamOrder

    def rows(self, xi: Array, derivative: int = 0) -> Array:
        """Rows of u, v, w, theta in element axes on the element's (global) dofs at xi (q,): (e, q, 4, n_local)."""
        rows = field_rows(self.order, xi, self.length, derivative)
        for node in range(0, NODAL, 3):
            rows[..., node : node + 3] = np.matmul(rows[..., node : node + 3], self.frame[:, None])
        return rows

    def places(self, xi: Array, offsets: Array) -> Array:
        """Undeformed positions (e, q, k, 3) of section points offsets (e, q, k, 2) at xi (q,)."""
        axis = self.origin[:, None] + self.length[:, None, None] * xi[:, None] * self.frame[:, None, 0]
        return axis[:, :, None] + np.matmul(offsets, self.frame[:, None, 1:])

    def motion(self, xi: Array, offsets: Array, rotary: bool = True) -> Array:
        """Rows of the global displacement u + theta x offset of section points: (e, q, k, 3, n_local).

        Without rotary the section moves along x as a whole: the offsets see the twist alone.
        """
        rows = self.rows(xi)
        y, z = offsets[..., 0, None], offsets[..., 1, None]
        u, v, w, theta = (rows[:, :, None, i] for i in range(4))
        axial = np.broadcast_to(u, (*offsets.shape[:3], rows.shape[-1]))
        if rotary:
            slope = self.rows(xi, 1)
            axial = u - y * slope[:, :, None, 1] - z * slope[:, :, None, 2]
        local = np.stack([axial, v - z * theta, w + y * theta], axis=-2)
        return np.matmul(self.frame.swapaxes(1, 2)[:, None, None], local)

    def turn(self, xi: Array, rotary: bool = True) -> Array:
        """Rows of the global rotation (theta, -w', v') of sections (e, q, 3, n_local); without rotary, twist alone."""
        rows, slope = self.rows(xi), self.rows(xi, 1)
        local = np.stack([rows[:, :, 3], -rotary * slope[:, :, 2], rotary * slope[:, :, 1]], axis=2)
        return np.matmul(self.frame.swapaxes(1, 2)[:, None], local)


def stations(elements: BeamElements, member: Member, degree: int) -> tuple[Array, Array, Resultants]:
    """Gauss points xi (q,), lengths they stand for (e, q) [m], and the section's resultants there (e, q)."""
    points, weights = get_quadrature(RefLine, degree)
    s = elements.arc.at(points[0])
    resultants = member.section.resultants(member.material, s, elements.arc.whole[:, None])
    return points[0], elements.length[:, None] * weights, resultants
