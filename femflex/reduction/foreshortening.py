"""How a spin stiffens a body's lowest shape: its foreshortening, which linear strain leaves out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody
from femflex.fem.structure import Structure
from femflex.reduction.accelerations import work_of_accelerations
from femflex.reduction.derivatives import scaled_derivatives
from femflex.reduction.modeset import ModeSet

Array = NDArray[np.float64]


def foreshortening(structure: Structure, modes: ModeSet) -> Array:
    """G (4, 3): int z theta^T dm over its stiffness, z = (1, rho), theta the static derivative of the lowest shape.

    In a field of accelerations -(b + W r), W = omega omega^T - |omega|^2 1, the lowest shape is stiffened by the part
    b . G[0] + W : G[1:] of its own stiffness (see `stiffened_by`). Zeros for a set without shapes.
    """
    if not modes.n_modes:
        return np.zeros((4, 3))
    energy = np.einsum("in,in->n", modes.phi, structure.K @ modes.phi)
    lowest = modes.picked([int(np.argmin(energy / np.einsum("in,in->n", modes.phi, structure.M @ modes.phi)))])
    theta = scaled_derivatives(structure, lowest)
    return np.asarray(work_of_accelerations(structure, theta)[:, :, 0])


def foreshortening_of(body: FlexibleBody) -> Array:
    """The same G (4, 3) of a condensed body."""
    if not len(body.slaves):
        return np.zeros((4, 3))
    n, moments = body.n_modes, body.moments
    stiffness = np.diag(body.strain.V1)
    lowest = int(np.argmin(stiffness / np.diag(moments.elastic_mass())[:n]))
    followed = body.slaves[:, lowest, lowest] / stiffness[lowest]
    rows = np.concatenate([moments.first[1 + n :, None, :], moments.second[0, :, 1 + n :, :].swapaxes(0, 1)], axis=1)
    return np.asarray(np.einsum("s,sza->za", followed, rows))
