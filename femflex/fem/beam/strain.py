"""The strain table of a beam member: stretch, and curvature and twist to second order in the rotation of sections.

A section that turns by the vector psi = (theta, -w' + theta v'/2, v' + theta w'/2), whose x axis stays on the tangent,
is bent and twisted by kappa = psi' - psi x psi' / 2 (Hodges and Dowell, NASA TN D-7818 (1974), to second order):

    kappa_x = theta' + (w' v'' - v' w'') / 2      kappa_y = -w'' + theta v''      kappa_z = v'' + theta w''

which goes beyond THEORY section 3. EIy kappa_y^2 + EIz kappa_z^2 is right to third order in displacements so. At fourth
it wants third-order curvature too: without, a section alike in all directions would bend harder once it is twisted, by
theta^2. What third order asks for is one product, -(EIy - EIz) theta v'' w''; the table holds it as

    kappa_y = -w'' + c theta v''      kappa_z = v'' - c theta w''      c = (EIy - EIz) / (EIy + EIz)

which agrees with the above in energy to third order, tends to it for thin strips, and leaves a round section alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femflex.fem.beam.elements import BeamElements, stations
from femflex.fem.tables import DenseStrain

if TYPE_CHECKING:
    from femflex.fem.structure import Member

Array = NDArray[np.float64]


def beam_strain(elements: BeamElements, member: Member, degree: int, options: dict[str, Any]) -> DenseStrain:
    """Strains (eps, kappa_z, kappa_y, r kappa_x), r^2 = I_p / A, of the gradients that `strain_maps` lists.

    The twist is carried as r theta' with stiffness GJ / r^2, so that its share of the axial strain is a constant too.
    """
    xi, weight, r = stations(elements, member, degree)
    value, first, second = (elements.rows(xi, derivative) for derivative in range(3))
    polar, uneven = np.sqrt(r.polar2)[..., None], np.asarray(unevenness(r.EIy, r.EIz))[..., None]
    first[:, :, 3] *= polar
    elastic = np.stack([r.EA, r.EIz, r.EIy, r.GJ / r.polar2], axis=-1)[..., None] * np.eye(4)
    turned = np.stack([uneven * value[:, :, 3], polar * first[:, :, 1], polar * first[:, :, 2]], axis=2)
    G = np.concatenate([first, second[:, :, 1:3], turned], axis=2)
    stress = np.zeros((*weight.shape, 4))
    stress[:, :, 0] = options["prestress"] - r.EA * options["thermal_strain"]
    return DenseStrain(elements.dofs, weight, elastic, *strain_maps(), G, stress)


def unevenness(EIy: Array | float, EIz: Array | float) -> Array | float:
    """c = (EIy - EIz) / (EIy + EIz), the share of a section's turn that changes its curvatures."""
    return (EIy - EIz) / (EIy + EIz)


def strain_maps() -> tuple[Array, Array]:
    """Linear (4, 9) and quadratic map (4, 9, 9) from (u', v', w', r theta', v'', w'', c theta, r v', r w')."""
    linear, quadratic = np.zeros((4, 9)), np.zeros((4, 9, 9))
    linear[[0, 1, 2, 3], [0, 4, 5, 3]] = 1.0, 1.0, -1.0, 1.0
    quadratic[0, range(4), range(4)] = 1.0
    for strain, row, column, value in ((1, 6, 5, -1.0), (2, 6, 4, 1.0), (3, 8, 4, 0.5), (3, 7, 5, -0.5)):
        quadratic[strain, [row, column], [column, row]] = value
    return linear, quadratic
