"""Shapes in which a structure answers harmonic loads of one frequency, solved on all of its degrees of freedom.

A craft moves harmonically at w. The displacement of a body relative to its clamp obeys
(K (1 + i eta) - w^2 M) x = F f + w^2 M R a, with the forces f at its markers and the motion a of its clamp. It lies in
the span of the responses to the columns of F and M R, whatever the rest of the craft does. A body reduced to these
shapes therefore makes the motion of the whole craft at w that of its mesh, without error of reduction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import independent_columns, rigid_shapes
from femflex.reduction.boundary.supported import supported
from femflex.reduction.modes.residuals import independent_combinations
from femflex.reduction.modes.vibration import ModeSet, ritz


def with_harmonic_responses(
    structure: Structure, modes: ModeSet, F: Array, omega: float, stiffness: complex, mass: complex = 1.0
) -> ModeSet:
    """The span of a set and of the responses to loads F (n_dof, k) of a frequency omega [rad/s].

    stiffness, mass  factors [1] of K and M by damping: 1 + i eta of structural damping. The shapes are M-orthonormal
    modes of the structure confined to them, without rigid motion where nothing is held.
    """
    part = supported(structure, modes.held)
    D = sparse.csc_array(stiffness * part.K - omega**2 * mass * part.M)
    x = np.zeros((structure.n_dof, F.shape[1]), complex)
    x[part.free] = splu(D).solve(F[part.free].astype(complex))
    shapes = np.column_stack([x.real, x.imag])
    if not modes.held.size:
        R = rigid_shapes(structure)
        R = R[:, independent_columns(R)]
        MR = structure.M @ R
        shapes -= R @ np.linalg.solve(R.T @ MR, MR.T @ shapes)
    phi = independent_combinations(structure, modes.phi)
    for _ in range(2):
        shapes = shapes - phi @ (phi.T @ (structure.M @ shapes))
    size = np.sqrt(np.einsum("in,in->n", shapes, structure.M @ shapes))
    whole = np.sqrt(np.einsum("in,in->n", x.conj(), structure.M @ x).real)
    shapes = shapes[:, size > 1e-9 * np.concatenate([whole, whole])]
    own, phi = ritz(structure, np.column_stack([phi, independent_combinations(structure, shapes)]))
    return replace(modes, phi=phi, kinds=("attachment",) * len(own), omega=own)
