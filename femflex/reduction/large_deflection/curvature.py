"""Softening and hardening in bending, of structures that are curved or whose supports prevent foreshortening.

With the amplitude q of a shape prescribed and all else relaxed, V = k q^2 / 2 + c q^3 + e q^4 to fourth order, where c
is zero for a flat structure. Its tangent stiffness k + 6 c q + 12 e q^2 then falls to one side: below zero where it
snaps through.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.large_deflection.foreshortening import second_order_response
from femflex.reduction.modes.vibration import ModeSet, responses_to_clamp_accelerations, static_response

REACH = 0.1  # displacement over size up to which the structure is assessed
LOOKED_AT = 3  # number of the lowest vibration shapes that are assessed


def least_stiffness_ratio(structure: Structure, modes: ModeSet) -> float:
    """The least tangent stiffness of low shapes over that at rest: 1 flat, below 0 it snaps.

    These are the lowest vibration shapes and, in a clamped set, the static response to an acceleration along its rise,
    because all of the lowest shapes of an arch may leave its crown at rest.
    """
    lowest = [k for k, kind in enumerate(modes.kinds) if kind in ("vibration", "free-free")][:LOOKED_AT]
    if not lowest:
        return 1.0
    phi = modes.phi[:, lowest]
    if modes.held.size and mesh_rise(structure):
        phi = np.column_stack(
            [phi, responses_to_clamp_accelerations(structure, modes)[1] @ _rise_and_direction(structure)[1]]
        )
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    k, cubic, quartic = energy_coefficients(structure, modes, phi)
    q = np.linspace(-1.0, 1.0, 401)[:, None] * REACH * size / np.abs(structure.translation @ phi).max(axis=0)
    return min(1.0, float((1 + (6 * cubic * q + 12 * quartic * q**2) / k).min()))


def hardening(structure: Structure, modes: ModeSet) -> float:
    """The cubic over the linear stiffness force of the lowest shape, at a deflection of 1 m [1/m^2].

    It is 4 e / k: of order 1 / thickness^2 if supports prevent a flat structure from foreshortening, and nearly zero if
    they do not. It is zero for a set without shapes, and for a softening shape.
    """
    if not modes.n_modes:
        return 0.0
    lowest = modes.picked([int(np.argmin(over_mass(structure, modes)))])
    phi = lowest.phi / np.sqrt(np.einsum("in,in->n", lowest.phi, structure.K @ lowest.phi))
    moved = np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max()
    load, response = (column[:, 0] for column in second_order_response(structure, lowest))
    relaxed_by, work = load @ response, load @ phi[:, 0]
    quartic = structure.internal_force.quartic_energy(phi)[0] - (relaxed_by - work**2) / 8
    return max(float(4 * quartic / moved**2), 0.0)


def energy_coefficients(structure: Structure, modes: ModeSet, phi: Array) -> tuple[Array, Array, Array]:
    """Energy coefficients k, c and e of shapes (n_dof, n) [m, rad], each with a prescribed amplitude.

    The supports are those of the set.
    """
    elastic = structure.internal_force
    k = np.einsum("in,in->n", phi, structure.K @ phi)
    load = elastic.second_derivative(phi)
    relaxed_by = np.einsum("in,in->n", load, static_response(structure, modes, load))
    work = np.einsum("in,in->n", load, phi)
    quartic = elastic.quartic_energy(phi) - (relaxed_by - work**2 / k) / 8
    return k, work / 6, quartic


def mesh_rise(structure: Structure) -> float:
    """The rise [m]: the extent of the mesh normal to the plane or line that fits it best; zero for a straight line."""
    return _rise_and_direction(structure)[0]


def _rise_and_direction(structure: Structure) -> tuple[float, Array]:
    """The rise of the mesh [m], and its direction (3,)."""
    centred = structure.mesh.points - structure.mesh.points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    spans = np.ptp(centred @ axes.T, axis=0)
    extended = np.flatnonzero(spans > 1e-9 * spans.max())
    if len(extended) < 2:
        return 0.0, np.zeros(3)
    least = int(extended[np.argmin(spans[extended])])
    return float(spans[least]), axes[least]
