"""Loads of accelerations on shapes, uniform or linear in position: those of any spin or accelerated base.

The field e_b (1, rho_a) of a body that turns and accelerates loads a shape theta by int (1, rho_a) theta_b dm. Where
theta is a static derivative, this is how the field stiffens or softens the pair of shapes it belongs to.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.fem.tables import DenseInertia, cached_chunks
from femflex.reduction.boundary.rigid import linear_motion, linear_shapes, rigid_motion, rigid_shapes

ANSWERED = 1e-4  # share of the response to a field, by amplitude, that may be omitted
SILENT = 1e-6  # response over the largest of all fields, below which it is rounding
RANK = 1e-12  # of the largest energy: below it a combination is dependent on others


def loads_of_rigid_accelerations(structure: Structure) -> Array:
    """int N^T a dm (n_dof, 6) [kg, kg m] of three unit translational and three unit rotational accelerations a.

    The rotational ones are about the origin.

    This is M R, except for masses offset from nodes of flat plates, which do not turn about the normal with the body.
    """
    how = rigid_shapes, rigid_motion
    found: Array = structure.recalled(("rigid loads",), lambda: _loads(structure, *how))
    return found


def loads_of_linear_accelerations(structure: Structure) -> Array:
    """int N^T a dm (n_dof, 12) [kg, kg m] of the fields a = z_a e_b, z = (1, r), uniform or linear in position."""
    how = linear_shapes, linear_motion
    found: Array = structure.recalled(("linear loads",), lambda: _loads(structure, *how))
    return found


def _loads(
    structure: Structure, shapes: Callable[[Structure], Array], motion: Callable[[Array], tuple[Array, Array]]
) -> Array:
    """int N^T a dm (n_dof, k) of k fields of acceleration, given by the dofs and by the motion of points."""
    followed = shapes(structure)
    raw, left = structure.T @ followed, np.zeros((structure.T.shape[0], followed.shape[1]))
    for block in structure.inertia:
        if isinstance(block, DenseInertia):
            a = motion(block.rho.reshape(-1, 3))[0].reshape(*block.rho.shape, -1) - block.shapes(raw, slice(None))
            N = np.broadcast_to(block.N, (len(block.dm), *block.N.shape[1:]))
            np.add.at(left, block.dofs, np.einsum("eqal,eq,eqak->elk", N, block.dm, a, optimize=True))
    return np.asarray(structure.M @ followed + structure.T.T @ left)


def work_of_accelerations(structure: Structure, shapes: Array) -> Array:
    """int z shape^T dm (4, 3, n) [kg m, kg m^2] over z = (1, rho), for shapes (n_dof, n) [m, rad] on the independent
    dofs."""
    raw = structure.T @ shapes
    total = np.zeros((4, 3, shapes.shape[1]))
    for block in structure.inertia:
        for chunk in cached_chunks(len(block.dm), 3 * block.dm.shape[1] * (1 + shapes.shape[1])):
            dm, rho = block.dm[chunk].ravel(), block.rho[chunk].reshape(-1, 3)
            z = np.column_stack([dm, dm[:, None] * rho])
            total += (z.T @ block.shapes(raw, chunk).reshape(len(dm), -1)).reshape(total.shape)
    return total


def answers_to_accelerations(structure: Structure, theta: Array, kept: Array) -> Array:
    """Combinations (n_dof, k) of shapes theta to add to kept ones for the response to every linear acceleration field.

    They are static responses of the structure confined to theta. With them added to the kept ones, the part of any
    theta that the shapes represent in the least-energy sense does the same work on a field as the whole theta. kept
    (n_dof, m) and the result are K-orthonormal.
    """
    K_theta = structure.K @ theta
    inside = kept.T @ K_theta
    energy, V = np.linalg.eigh(theta.T @ K_theta - inside.T @ inside)
    left = energy > RANK * np.einsum("ip,ip->p", theta, K_theta).max(initial=0.0)
    if not left.any():
        return kept[:, :0]
    basis = (theta - kept @ inside) @ (V[:, left] / np.sqrt(energy[left]))
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    scale = np.array([1.0, *[1.0 / size] * 3])[:, None, None]
    work = scale * work_of_accelerations(structure, np.column_stack([basis, kept]))
    lacking, known = np.split(work.reshape(12, -1).T, [basis.shape[1]])
    answer = np.sqrt((lacking**2).sum(axis=0) + (known**2).sum(axis=0))
    heard = answer > SILENT * answer.max(initial=0.0)
    U, part, _ = np.linalg.svd(lacking[:, heard] / answer[heard], full_matrices=False)
    return np.asarray(basis @ U[:, part > ANSWERED])
