"""The strain table of a beam member."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.fem.beam.elements import BeamElements, stations
from femflex.fem.tables import DenseStrain

if TYPE_CHECKING:
    from femflex.fem.structure import Member


def beam_strain(elements: BeamElements, member: Member, degree: int, options: dict[str, Any]) -> DenseStrain:
    """Strains (eps, kappa_z, kappa_y, r theta') of gradients (u', v', w', r theta', v'', w''), r^2 = I_p / A.

    The twist is carried as r theta' with stiffness GJ / r^2, so that its share of the axial strain is a constant too.
    """
    xi, weight, r = stations(elements, member, degree)
    first, second = elements.rows(xi, 1), elements.rows(xi, 2)
    first[:, :, 3] *= np.sqrt(r.polar2)[..., None]
    elastic = np.stack([r.EA, r.EIz, r.EIy, r.GJ / r.polar2], axis=-1)[..., None] * np.eye(4)
    linear_map = np.zeros((4, 6))
    linear_map[[0, 1, 2, 3], [0, 4, 5, 3]] = 1.0, 1.0, -1.0, 1.0
    quadratic_map = np.zeros((4, 6, 6))
    quadratic_map[0, range(4), range(4)] = 1.0
    G = np.concatenate([first, second[:, :, 1:3]], axis=2)
    stress = np.zeros((*weight.shape, 4))
    stress[:, :, 0] = options["prestress"] - r.EA * options["thermal_strain"]
    return DenseStrain(elements.dofs, weight, elastic, linear_map, quadratic_map, G, stress)
