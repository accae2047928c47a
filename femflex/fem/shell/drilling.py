"""Rotations about the normal of a shell, at nodes that have them: folds, branches, and nodes shared with beams.

Shells resist no rotation of a node about their director. Where only smooth shells share a node, it has no such dof. At
other nodes it follows the rotation of the surface in itself, omega = (t_2.u,1 - t_1.u,2) / 2, by the energy

    DRILLING G h / 2 sum (theta.n - omega)^2 (area of the corner)

which is zero where the two agree, as they do in the exact solution (T. J. R. Hughes and F. Brezzi, Comp. Meth. Appl.
Mech. Engng 72 (1989) 105).
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import BoolArray, IntArray
from femflex.fem.shell.fields import ShellGeometry, areas, gradient_rows
from femflex.fem.tables import DenseStrain
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature

DRILLING = 0.1  # of the shear stiffness in the plane


def drilling(geometry: ShellGeometry, dofs: IntArray, drilled: BoolArray, shear: float) -> tuple[DenseStrain, ...]:
    """Strain theta.n - omega at the nodes (e, k) that have a rotation about the director; none where none has.

    shear: stiffness G h [N/m]
    """
    elements = np.flatnonzero(drilled.any(axis=1))
    if not len(elements):
        return ()
    drilled_geometry = geometry.of_elements(elements)
    cell = CELL_TYPES[geometry.cell]
    k = len(cell.nodes)
    G, (_, normal) = gradient_rows(drilled_geometry, cell.nodes), areas(drilled_geometry, cell.nodes)
    rows = (G[:, :, 1] - G[:, :, 2])[:, :, None] / 2  # -omega
    for node in range(k):
        rows[:, node, 0, 3 * (k + node) : 3 * (k + node) + 3] += normal[:, node]
    points, weight = quadrature(cell.shape, cell.order + 1)
    total = areas(drilled_geometry, points)[0] @ weight
    share = np.where(drilled[elements], total[:, None] / k, 0.0)
    elastic = np.full((1, 1, 1, 1), DRILLING * shear)
    return (DenseStrain(dofs[elements], share, elastic, np.ones((1, 1)), np.zeros((1, 1, 1)), rows),)
