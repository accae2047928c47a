"""Whether a structure is curved, or held apart, as far as its bending goes: how soft or stiff bent shapes become.

With the amplitude q of a shape held and all else relaxed, V = k q^2 / 2 + c q^3 + e q^4 to fourth order, c being zero
of what is flat. Its tangent stiffness k + 6 c q + 12 e q^2 then falls to one side: below zero where it snaps through.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.large_deflection.own_bend import own_bend
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response
from femflex.reduction.modes.vibration import answers_to_clamps

REACH = 0.1  # displacement over size up to which it is looked at
LOOKED_AT = 3  # of the lowest vibration shapes


def least_stiffness_ratio(structure: Structure, modes: ModeSet) -> float:
    """The least tangent stiffness of low shapes over that at rest: 1 flat, below 0 it snaps.

    Of the lowest vibration shapes and, in a clamped set, the static answer to an acceleration along its rise: the
    lowest shapes of an arch may all be of those that leave its crown where it is.
    """
    lowest = [k for k, kind in enumerate(modes.kinds) if kind in ("vibration", "free-free")][:LOOKED_AT]
    if not lowest:
        return 1.0
    phi = modes.phi[:, lowest]
    if modes.held.size and mesh_rise(structure):
        phi = np.column_stack([phi, answers_to_clamps(structure, modes)[1] @ _risen(structure)[1]])
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    k, cubic, quartic = held_energy(structure, modes, phi)
    q = np.linspace(-1.0, 1.0, 401)[:, None] * REACH * size / np.abs(structure.translation @ phi).max(axis=0)
    return min(1.0, float((1 + (6 * cubic * q + 12 * quartic * q**2) / k).min()))


def hardening(structure: Structure, modes: ModeSet) -> float:
    """What stretching adds to the force on the lowest shape, over its linear one, as it is bent by 1 m [1/m^2].

    4 e / k: (bend / thickness)^2 times some figure where supports hold a flat structure apart, next to nothing where it
    may draw in. Zero of a set without shapes, and of what softens.
    """
    if not modes.n_modes:
        return 0.0
    one = modes.picked([int(np.argmin(over_mass(structure, modes)))])
    phi = one.phi / np.sqrt(np.einsum("in,in->n", one.phi, structure.K @ one.phi))
    moved = np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max()
    bent, answer = (column[:, 0] for column in own_bend(structure, one))
    relaxed, along = bent @ answer, bent @ phi[:, 0]
    quartic = structure.internal_force.quartic_energy(phi)[0] - (relaxed - along**2) / 8
    return max(float(4 * quartic / moved**2), 0.0)


def held_energy(structure: Structure, modes: ModeSet, phi: Array) -> tuple[Array, Array, Array]:
    """k, c and e of shapes (n_dof, n) [m, rad], each held alone, with the supports of a set."""
    elastic = structure.internal_force
    k = np.einsum("in,in->n", phi, structure.K @ phi)
    bent = elastic.second_derivative(phi)
    relaxed = np.einsum("in,in->n", bent, static_response(structure, modes, bent))
    along = np.einsum("in,in->n", bent, phi)
    quartic = elastic.quartic_energy(phi) - (relaxed - along**2 / k) / 8
    return k, along / 6, quartic


def mesh_rise(structure: Structure) -> float:
    """How far the mesh stands off the plane, or the line, that lies best in it [m]; zero of a straight line."""
    return _risen(structure)[0]


def _risen(structure: Structure) -> tuple[float, Array]:
    """The rise of the mesh [m], and its direction (3,)."""
    centred = structure.mesh.points - structure.mesh.points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    spans = np.ptp(centred @ axes.T, axis=0)
    standing = np.flatnonzero(spans > 1e-9 * spans.max())
    if len(standing) < 2:
        return 0.0, np.zeros(3)
    least = int(standing[np.argmin(spans[standing])])
    return float(spans[least]), axes[least]
