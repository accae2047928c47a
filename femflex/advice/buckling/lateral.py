"""Moments of beams that buckle them laterally.

A moment about an axis of stiffness EI_1 buckles a beam sideways at pi sqrt(EI_2 GJ) / L, over the root of (1 - EI_2 /
EI_1) (1 - GJ / EI_1) for the deflection before buckling, where EI_2 is the stiffness about the other axis (Hodges and
Peters, Int. J. Solids Structures 11 (1975) 1269). Linear buckling neglects this deflection; here its moments are
multiplied by that root. They vanish in round tubes, and where a beam bends about its weak axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.fem.beam.strain import BeamStrain
from femflex.fem.internal_force import InternalForce
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock


def lateral_share(EI_1: Array | float, EI_2: Array | float, GJ: Array | float) -> Array:
    """Share [1] of a moment about the axis of stiffness EI_1 that buckles a beam laterally.

    EI_2: stiffness about the other axis; GJ: torsional stiffness [N m^2].

    >>> float(lateral_share(1.0, 1.0, 0.8)), float(lateral_share(1e4, 1.0, 4.0))  # a round tube, a thin strip
    (0.0, 0.999...)
    """
    other, twist = (np.clip(1.0 - np.asarray(stiffness) / EI_1, 0.0, 1.0) for stiffness in (EI_2, GJ))
    return np.asarray(np.sqrt(other * twist))


def buckling_force(structure: Structure) -> InternalForce:
    """The elastic force of a structure whose beams have the share of their bending stress that buckles them."""
    return InternalForce(_with_shares(structure.strain), structure.T)


def _with_shares(blocks: Sequence[StrainBlock]) -> list[StrainBlock]:
    out: list[StrainBlock] = []
    for block in blocks:
        if isinstance(block, BeamStrain):
            EIz, EIy = block.elastic[..., 1, 1], block.elastic[..., 2, 2]  # strains (eps, kappa_z, kappa_y, r kappa_x)
            GJ = block.elastic[..., 3, 3] * block.polar2
            shares = np.ones(block.elastic.shape[:-1])
            shares[..., 1], shares[..., 2] = lateral_share(EIz, EIy, GJ), lateral_share(EIy, EIz, GJ)
            out.append(replace(block, elastic=shares[..., None] * block.elastic))
        else:
            out.append(block)
    return out
