"""Second-order effects of single shapes that linear strain leaves out: foreshortening, hardening and softening."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256

import numpy as np
from scipy import linalg

from femflex.arrays import Array
from femflex.body import FlexibleBody, Foreshortening
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.inertia.accelerations import work_of_accelerations
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.modes.vibration import ModeSet, responses_to_clamp_accelerations, static_response

ALONE = 1e-6  # share of the other shapes in the lowest shape of a set, by mass, below which it is one shape of the set


def foreshortening(structure: Structure, modes: ModeSet, markers: Mapping[str, str] | None = None) -> Foreshortening:
    """The Foreshortening of the lowest shape in the span of a set: theta is its static derivative.

    markers: name -> mesh group; the set's own groups count under their own names. None of a set without shapes.
    """
    if not modes.n_modes:
        return Foreshortening()
    phi = _lowest_shape(structure, modes)
    theta = -second_order_response(structure, replace(modes.picked([0]), phi=phi))[1]
    places = {**{group: group for group in modes.groups}, **(markers or {})}
    at = {name: (marker_rows(structure, group).translation @ theta)[:, 0] for name, group in places.items()}
    return Foreshortening(work_of_accelerations(structure, theta)[:, :, 0], at)


def _lowest_shape(structure: Structure, modes: ModeSet) -> Array:
    """The lowest shape (n_dof, 1) [m, rad] of the span of a set: one of the set if others have little part in it."""
    K, M = (modes.phi.T @ (A @ modes.phi) for A in (structure.K, structure.M))
    lowest = linalg.eigh(K, M, subset_by_index=[0, 0])[1]  # of a set of unit displacements, a mixture of many
    part = np.abs(lowest[:, 0]) * np.sqrt(np.diag(M))
    own = int(part.argmax())
    if np.delete(part, own).max(initial=0.0) < ALONE * part[own]:
        return np.ascontiguousarray(modes.phi[:, [own]])
    return np.asarray(modes.phi @ lowest)


def foreshortening_of(body: FlexibleBody) -> Foreshortening:
    """The Foreshortening of the lowest shape of a condensed body."""
    if not len(body.slaves):
        return Foreshortening()
    n, moments = body.n_modes, body.moments
    stiffness = np.diag(body.strain.V1)
    lowest = int(np.argmin(stiffness / np.diag(moments.elastic_mass())[:n]))
    followed = body.slaves[:, lowest, lowest] / stiffness[lowest]
    rows = np.concatenate([moments.first[1 + n :, None, :], moments.second[0, :, 1 + n :, :].swapaxes(0, 1)], axis=1)
    at = {name: marker.phi[:, n:] @ followed for name, marker in body.markers.items()}
    return Foreshortening(np.asarray(np.einsum("s,sza->za", followed, rows)), at)


def second_order_response(structure: Structure, shape: ModeSet) -> tuple[Array, Array]:
    """The load (dK/dphi) phi of a set of one shape, and the response K^-1 (dK/dphi) phi to it, (n_dof, 1) both.

    The shape is scaled to unit strain energy phi.K phi = 1. The negative response is the static derivative theta of the
    shape (`derivatives`).
    """
    key = ("own bend", shape.held.tobytes(), shape.reference, sha256(shape.phi.tobytes()).digest())
    result: tuple[Array, Array] = structure.recalled(key, lambda: _second_order_response(structure, shape))
    return result


def _second_order_response(structure: Structure, shape: ModeSet) -> tuple[Array, Array]:
    phi = shape.phi / np.sqrt(np.einsum("in,in->n", shape.phi, structure.K @ shape.phi))
    load = structure.internal_force.second_derivative(phi)
    return load, static_response(structure, shape, load)


# Softening and hardening in bending, of structures that are curved or whose supports prevent foreshortening.
#
# With the amplitude q of a shape prescribed and all else relaxed, V = k q^2 / 2 + c q^3 + e q^4 to fourth order, where
# c is zero for a flat structure. Its tangent stiffness k + 6 c q + 12 e q^2 then falls to one side: below zero where it
# snaps through.


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
