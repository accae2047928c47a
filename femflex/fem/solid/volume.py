"""Strain of nearly incompressible solids: a part of the volumetric energy is integrated at fewer points, so that they
do not lock.

A second-order element whose volume is constrained at every point can hardly deform. The part of Lame's lambda above
its value at a Poisson's ratio of FULL acts on the projection of the displacement gradient onto fewer functions
(mean dilatation, T. J. R. Hughes, Int. J. Num. Meth. Engng 15 (1980) 1413): linear ones over bricks of 20 nodes,
trilinear over those of 27, linear ones along wedges, one value elsewhere. Projecting all of lambda would make
bending too soft: a displacement of second order, a conformal map, changes only the volume.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic
from femflex.fem.solid.blocks import Dilatation, SolidStrain
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature

# Poisson's ratios; higher where the projection has few functions, which would make bending too soft
FULL = {
    "hexahedron": 0.35,
    "wedge": 0.45,
    "tetra": 0.45,
    "pyramid": 0.45,
}


def with_reduced_volume_points(
    name: str, strain: SolidStrain, points: Array, material: Material | Orthotropic | Anisotropic
) -> SolidStrain:
    """Return the strain of second-order elements at points (q, 3) of the unit cell, with separate points for the volume
    if the material is isotropic and its Poisson's ratio is above FULL."""
    full = FULL[CELL_TYPES[name].shape]
    if CELL_TYPES[name].order == 1 or not isinstance(material, Material) or material.nu <= full:
        return strain
    volume_points = _volume_points(name)
    spread, basis = _trilinear(volume_points, points), _basis(name, points)
    weighted = strain.weight[:, :, None] * basis
    moments = np.matmul(weighted.swapaxes(1, 2), basis)
    project = np.matmul(_basis(name, volume_points), np.linalg.solve(moments, weighted.swapaxes(1, 2)))  # (e, m, q)
    e, q, _, k = strain.G.shape
    G = np.matmul(project, strain.G.reshape(e, q, 3 * k)).reshape(e, -1, 3, k)
    mu = material.E / 2 / (1 + material.nu)
    bulk = 2 * mu * (material.nu / (1 - 2 * material.nu) - full / (1 - 2 * full))
    linear, quadratic = np.zeros((6, 10)), np.zeros((6, 10, 10))
    linear[:, :9], quadratic[:, :9, :9] = strain.linear_map, strain.quadratic_map
    linear[:3, 9] = 3 * bulk / strain.elastic[0, 0, :3, :3].sum()  # the stress is the sum of both parts'
    dilatation = Dilatation(G, strain.weight @ spread, spread, bulk)
    return replace(strain, linear_map=linear, quadratic_map=quadratic, dilatation=dilatation)


def _volume_points(name: str) -> Array:
    """Points (m, 3) of the unit cell for the volume."""
    if CELL_TYPES[name].shape == "hexahedron":
        return quadrature("hexahedron", 2)[0]
    z = quadrature("line", 2)[0] if CELL_TYPES[name].shape == "wedge" else np.array([[0.5]])
    return np.column_stack([np.full((len(z), 2), 1 / 3), z])


def _trilinear(nodes: Array, points: Array) -> Array:
    """Values (q, m) at points (q, 3) of the functions, linear in each axis, that are 1 at one of the nodes (m, 3)."""
    axes = np.flatnonzero(np.ptp(nodes, axis=0) > 0)
    powers = np.array(list(np.ndindex(*(2,) * len(axes))))
    node_values, values = (np.prod(positions[:, None, axes] ** powers, axis=2) for positions in (nodes, points))
    return np.asarray(values @ np.linalg.inv(node_values))


def _basis(name: str, points: Array) -> Array:
    """Functions (q, p) at points (q, 3) onto which gradients are projected."""
    volume_points = _volume_points(name)
    if name == "hexahedron20":
        return np.column_stack([np.ones(len(points)), points])
    return _trilinear(volume_points, points)
