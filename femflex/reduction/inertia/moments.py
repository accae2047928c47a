"""Mass moments of shapes from the inertia table, by matrix products over chunks of its points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from femflex.arrays import Array
from femflex.body import MassMoments
from femflex.body.moments import MassPoints
from femflex.fem.structure import Structure
from femflex.fem.tables import InertiaBlock, StrainBlock, cached_chunks, element_chunks

MOST_BYTES = 2e9  # of the second moments; some five thousand shapes
LONG = 100.0  # m; extent of a structure from which on its body keeps points of mass
MOST = 600  # points that are kept one by one; with more, the centre of each element stands for it


def mass_moments(inertia: Sequence[InertiaBlock], phi_raw: Array) -> MassMoments:
    """Mass moments, units as there, of z = (rho, phi) over all points of the inertia table (THEORY section 3).

    phi_raw (n_raw, n): shapes on the raw dofs, T phi. Memory stays bounded: blocks are cut into chunks of elements.
    """
    n = phi_raw.shape[1]
    size = 8 * (3 * (1 + n)) ** 2
    if size > MOST_BYTES:
        raise ValueError(
            f"the mass moments of {n} shapes would take {size / 1e9:.3g} GB; a body may take {MOST_BYTES / 1e9:g} GB. "
            "Reduce the structure to fewer shapes."
        )
    total = MassMoments(0.0, np.zeros((1 + n, 3)), np.zeros((1 + n, 3, 1 + n, 3)))
    for block in inertia:
        n_points = block.dm.shape[1]
        for chunk in cached_chunks(block.dm.shape[0], 2 * n_points * 3 * (1 + n)):
            dm, rho = block.dm[chunk].ravel(), block.rho[chunk].reshape(-1, 3)
            shapes = block.shapes(phi_raw, chunk) if n else np.zeros((dm.size, 3, 0))  # which takes their functions
            part = point_moments(dm, rho, shapes.reshape(dm.size, 3, n))
            total = MassMoments(total.mass + part.mass, total.first + part.first, total.second + part.second)
    return total


def point_moments(dm: Array, rho: Array, shapes: Array) -> MassMoments:
    """Mass moments of points dm (p,) [kg] at rho (p, 3) [m], moved by shapes (p, 3, n)."""
    z = np.concatenate([rho[:, :, None], shapes], axis=2)  # p, axis, 1 + n
    weighted = z * dm[:, None, None]
    flat = z.reshape(len(dm), 3 * z.shape[2])
    second = (weighted.reshape(flat.shape).T @ flat).reshape(3, z.shape[2], 3, z.shape[2])
    return MassMoments(float(dm.sum()), weighted.sum(axis=0).T, second.transpose(1, 0, 3, 2))


def linear_stiffness(K: sparse.csr_array, phi: Array) -> Array:
    """V1 = phi^T K phi, symmetric to the last bit, (n, n) [1/s^2]."""
    V1 = phi.T @ (K @ phi)
    return (V1 + V1.T) / 2


def strain_stiffness(strain: Sequence[StrainBlock], phi_raw: Array) -> Array:
    """V1 = sum of weight B0^T C B0 over the points of the strain table (THEORY section 3), (n, n) [1/s^2]."""
    n = phi_raw.shape[1]
    V1 = np.zeros((n, n))
    for block in strain:
        n_points, s, g = block.weight.shape[1], *block.linear_map.shape
        for chunk in element_chunks(block.weight.shape[0], n_points * n * (g + 2 * s)):
            B0 = block.linear_map @ block.gradients(phi_raw, chunk)
            elastic = block.elastic if block.elastic.shape[0] == 1 else block.elastic[chunk]
            stress = np.matmul(elastic, B0) * block.weight[chunk][:, :, None, None]
            V1 += np.einsum("eqsi,eqsj->ij", B0, stress, optimize=True)
    return (V1 + V1.T) / 2


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
