"""Internal (Kelvin-Voigt) damping of tethers and membranes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femflex.arrays import Array
from femflex.fem.deflected import tension_blocks
from femflex.fem.structure import Structure
from femflex.fem.tables import element_chunks


def internal_damping(structure: Structure, phi: Array, damped: Sequence[bool]) -> Array:
    """D = int B0^T C tau B0 (n, n) of shapes phi (n_dof, n) [m, rad], over tethers and membranes with a viscosity tau.

    Of the strain's linear part, on the shapes `damped` alone: with nonlinear strain the others take back the stretch of
    bending (`femflex.reduction.modes.damping.bending_damping`).
    """
    n = phi.shape[1]
    D = np.zeros((n, n))
    raw = structure.T @ np.where(damped, phi, 0.0)
    for block in tension_blocks(structure):
        if block.viscosity:
            q, s = block.weight.shape[1], len(block.linear_map)
            for chunk in element_chunks(len(block.dofs), q * n * (block.linear_map.shape[1] + 2 * s)):
                part = block.sampled(chunk)
                B0 = part.linear_map @ part.gradients(raw, slice(None))
                stress = np.matmul(part.elastic * block.viscosity, B0) * part.weight[..., None, None]
                D += np.einsum("eqsi,eqsj->ij", B0, stress, optimize=True)
    return (D + D.T) / 2
