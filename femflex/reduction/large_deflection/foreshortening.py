"""Foreshortening of the lowest shape of a body, by which axial loads stiffen it; linear strain leaves it out."""

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
from femflex.reduction.modes.vibration import ModeSet, static_response

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
