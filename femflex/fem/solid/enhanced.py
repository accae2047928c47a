"""Bricks of eight nodes with incompatible modes: parallelepipeds bend like second-order elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.fem.solid.blocks import Enhanced, SolidStrain, enhanced_strains
from femflex.mesh.cells import CELL_TYPES


def with_incompatible_modes(strain: SolidStrain, x: Array, points: Array) -> SolidStrain:
    """The strain of bricks with nodes x (e, 8, 3) [m] at points (q, 3) of the unit cell, with `Enhanced` strains."""
    cell = CELL_TYPES["hexahedron"]

    def jacobian(positions: Array) -> Array:
        return np.asarray(np.einsum("qkm,eki->eqmi", cell.gradients(positions), x - x[:, :1]))

    J0, centre = jacobian(np.full((1, 3), 0.5))[:, 0], 2 * points - 1
    ratio = np.linalg.det(J0)[:, None] / np.linalg.det(jacobian(points))
    slope = ratio[:, :, None, None] * (-2 * centre)[None, :, :, None] * np.linalg.inv(J0).swapaxes(1, 2)[:, None]
    B, G = enhanced_strains(slope), strain.rows(slice(None))
    stress = np.matmul(strain.elastic, B) * strain.weight[:, :, None, None]
    mode_stiffness = np.matmul(B.swapaxes(2, 3), stress).sum(axis=1)
    coupling = np.matmul(stress.swapaxes(2, 3), np.matmul(strain.linear_map, G)).sum(axis=1)
    linear, quadratic = np.zeros((6, 15)), np.zeros((6, 15, 15))
    linear[:, :9], linear[:, 9:] = strain.linear_map, np.eye(6)
    quadratic[:, :9, :9] = strain.quadratic_map
    enhanced = Enhanced(slope, -np.linalg.solve(mode_stiffness, coupling))
    return replace(strain, linear_map=linear, quadratic_map=quadratic, enhanced=enhanced)
