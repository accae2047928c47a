"""Points of mass of long bodies, over which the central attraction is integrated."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.body.mass_points import MassPoints
from femflex.fem.structure import Structure
from femflex.fem.tables import element_chunks

LONG = 100.0  # m; extent of a structure from which on its body keeps points of mass
MOST = 600  # points that are kept one by one; with more, the centre of each element stands for it


def mass_points(structure: Structure, phi: Array) -> MassPoints | None:
    """The points of the inertia table with shapes phi (n_dof, n) [m, rad]; None for a structure that is not LONG."""
    if np.linalg.norm(np.ptp(structure.mesh.points, axis=0)) < LONG:
        return None
    raw, n = structure.T @ phi, phi.shape[1]
    many = sum(block.dm.size for block in structure.inertia) > MOST
    found = []
    for block in structure.inertia:
        for chunk in element_chunks(len(block.dm), 3 * block.dm.shape[1] * (1 + n)):
            dm, rho, shapes = block.dm[chunk], block.rho[chunk], block.shapes(raw, chunk)
            if many:
                share = dm / dm.sum(axis=1, keepdims=True)
                rho, shapes = np.einsum("eq,eqa->ea", share, rho), np.einsum("eq,eqan->ean", share, shapes)
                dm = dm.sum(axis=1)
            found.append((dm.ravel(), rho.reshape(-1, 3), shapes.reshape(dm.size, 3, n)))
    return MassPoints(*(np.concatenate(parts) for parts in zip(*found, strict=True)))
