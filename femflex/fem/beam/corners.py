"""Rotations to second order where beams meet at an angle.

The fields of a beam along e take s = (theta, -w', v') at its ends, and its sections turn by the vector
psi = s - (e.s) e x s / 2. Beams in line share s and psi alike. Beams that meet at an angle, each with its own e, share
psi only: their fields take s = psi + (e.psi) e x psi / 2 there, to second order. Otherwise the moments at the corner
would do work on different rotations, and the lateral buckling load of an L-frame that bends in its plane would be some
per cents too low (J. H. Argyris and others, Comp. Meth. Appl. Mech. Engng 20 (1979) 105).

The fields at an end then have more of v' by theta psi_y / 2 and of -w' by -theta psi_z / 2, and the curvatures

    kappa_z   + H'' theta psi_y / 2      kappa_y   - H'' theta psi_z / 2

with H the shape function of the slope at that end. They are products of three gradients per end.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.beam.elements import BeamElements
from femflex.fem.beam.shapes import field_rows
from femflex.fem.line.chain import straight_elements

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


IN_LINE = 1e-6  # sine of the angle up to which beams at a node count as one straight line
SLOPES = (5, 11)  # local dofs theta_z of the two ends: the slopes v'
FAMILY = "beam"


def corner_nodes(mesh: Mesh, members: Iterable[Member], least: float = IN_LINE) -> IntArray:
    """Numbers (k,) of the nodes, ascending, where elements of beam members meet at an angle of a sine above least."""
    first = np.zeros((len(mesh.points), 3))
    angled = np.zeros(len(mesh.points), bool)
    for member in members:
        if member.family != FAMILY or member.group not in mesh.cell_groups:
            continue
        nodes = straight_elements(mesh.group_cells(member.group))
        axes = mesh.points[nodes[:, 1]] - mesh.points[nodes[:, 0]]
        axes = np.repeat(axes / np.linalg.norm(axes, axis=1, keepdims=True), 2, axis=0)
        ends = nodes.ravel()
        new_nodes, row = np.unique(ends, return_index=True)
        without_axis = ~first[new_nodes].any(axis=1)
        first[new_nodes[without_axis]] = axes[row[without_axis]]
        angled[ends[np.linalg.norm(np.cross(first[ends], axes), axis=1) > least]] = True
    return np.flatnonzero(angled)


def corner_gradients(elements: BeamElements, xi: Array, corners: BoolArray) -> Array:
    """Rows (e, q, 6, n_local) [rad per dof] of H'' theta, psi_y and psi_z of either end at xi (q,); zero at ends (e, 2)
    that are not corners."""
    slope = field_rows(elements.order, xi, elements.length, 2)[:, :, 1]
    rows = np.zeros((*slope.shape[:2], 6, slope.shape[2]))
    for end, dof in enumerate(SLOPES):
        turn = slice(dof - 2, dof + 1)
        rows[:, :, 3 * end, turn] = slope[:, :, dof, None] * elements.frame[:, None, 0]
        rows[:, :, 3 * end + 1 : 3 * end + 3, turn] = elements.frame[:, None, 1:]
        rows[:, :, 3 * end : 3 * end + 3] *= corners[:, end, None, None, None]
    return rows


def corner_products(first: int) -> tuple[tuple[int, int, int, float], ...]:
    """Return the strain, the two gradients and the factor of each product; `corner_gradients` are those from `first`
    on."""
    return tuple(
        product
        for end in (first, first + 3)
        for product in ((1, end, end + 1, 0.5), (2, end, end + 2, -0.5))  # kappa_z, kappa_y
    )
