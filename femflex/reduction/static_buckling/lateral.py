"""Linear buckling in few coordinates, and moments of beams that buckle them laterally.

A constant moment about an axis of stiffness EI_1 buckles a simply supported beam sideways at pi sqrt(EI_2 GJ) / L,
divided by the root of (1 - EI_2 / EI_1) (1 - GJ / EI_1) for the deflection before buckling, where EI_2 is the stiffness
about the other axis (Trahair, Flexural-Torsional Buckling of Structures (1993)). Linear buckling neglects this
deflection; here moments are multiplied by that root, which is exact for a constant moment and approximate for others
(for a cantilever under a load at its tip see Hodges and Peters, Int. J. Solids Structures 11 (1975) 1269). The product
vanishes for round tubes. Moments about a beam's weak axis are neglected: the beam would have to turn by several radians
before it buckles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import linalg

from femflex.arrays import Array
from femflex.fem.beam.strain import BeamStrain
from femflex.fem.internal_force import InternalForce
from femflex.fem.structure import Structure

STIFF = 1e3  # stiffness that fixes a marker, over the sum of that of all coordinates
ROUNDING = 1e-9  # magnitude of an eigenvalue below which it is zero


def lateral_share(EI_1: Array | float, EI_2: Array | float, GJ: Array | float) -> Array:
    """Share [1] of a moment about the axis of stiffness EI_1 that buckles a beam laterally.

    EI_2: stiffness about the other axis; GJ: torsional stiffness [N m^2].

    >>> float(lateral_share(1.0, 1.0, 0.8)), float(lateral_share(1e4, 1.0, 4.0))  # a round tube, a thin strip
    (0.0, 0.999...)
    """
    largest = np.maximum(EI_1, np.finfo(float).tiny)
    other, twist = (np.clip(1.0 - np.asarray(stiffness) / largest, 0.0, 1.0) for stiffness in (EI_2, GJ))
    return np.asarray(np.sqrt(other * twist))


def buckling_force(structure: Structure) -> InternalForce:
    """The elastic force of a structure whose beams have the share of their bending stress that buckles them."""
    if not any(isinstance(block, BeamStrain) for block in structure.strain):
        return structure.internal_force
    blocks = [_with_share(block) if isinstance(block, BeamStrain) else block for block in structure.strain]
    return InternalForce(blocks, structure.T)


def _with_share(block: BeamStrain) -> BeamStrain:
    """The block with the moments about the principal axes of its bending stiffness multiplied by their shares."""
    bending = slice(1, 3)  # of the strains (eps, kappa_z, kappa_y, r kappa_x)
    EI, axes = np.linalg.eigh(block.elastic[..., bending, bending])
    GJ = block.elastic[..., 3, 3] * block.polar2
    shares = np.stack([lateral_share(EI[..., k], EI[..., 1 - k], GJ) for k in range(2)], axis=-1)
    elastic = block.elastic.copy()
    elastic[..., bending, :] = (axes * shares[..., None, :]) @ (axes.swapaxes(-1, -2) @ elastic[..., bending, :])
    return replace(block, elastic=elastic)


def lowest_of_few(K_sigma: Array, K: Array, constraint: Array | None) -> tuple[float, Array]:
    """Lowest eigenvalue mu [1] of K_sigma x = mu (K + C) x, 0 within rounding, and its shape x (n,), x.(K + C) x = 1.

    All matrices (n, n) [N/m, N, N m]; C is the constraint, taken as stiff.
    """
    K = K if constraint is None else K + STIFF * np.trace(K) / np.trace(constraint) * constraint
    mu, x = linalg.eigh(K_sigma, K, subset_by_index=[0, 0])
    return float(mu[0]) if abs(mu[0]) > ROUNDING else 0.0, x[:, 0]
