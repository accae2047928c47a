"""Static stretch of condensed bodies under accelerations, at markers: the part that no coordinate represents.

Stretch is not a coordinate of a condensed body. The stretch by bending is a dependent one; that by spin, acceleration
and weight is not, though a boom of length L that spins at Om about its root grows by m Om^2 L^3 / 3 EA.
Far below the frequencies of stretch it is static, and linear in the field of acceleration of the body's own mass (mode
acceleration method, R. L. Bisplinghoff, H. Ashley and R. L. Halfman, Aeroelasticity, 1955).

The whole response beyond the shapes is included, also the bending of sheets in their own planes: when a plate at an
angle of 60 degrees is spun up, this cancels three quarters of the stretch at its corner.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.inertia.accelerations import loads_of_linear_accelerations
from femflex.reduction.modes.statics import static_response
from femflex.reduction.modes.vibration import ModeSet

REPRESENTED = 1e-8  # residual share of a response's strain energy, below which the coordinates represent it


def with_static_stretch(
    structure: Structure, modes: ModeSet, body: FlexibleBody, free: IntArray, groups: dict[str, str]
) -> FlexibleBody:
    """The body with the static stretch of its markers. free (n,): numbers of its coordinates among the set.

    groups: marker -> mesh group. The field is that of the undeformed positions: for a plate bent by four thicknesses
    the remaining effect of spin is 0.1 % of the foreshortening at its corner.
    """
    x = static_stretch(structure, modes, modes.phi[:, free])
    if not x.any():
        return body
    displacements = {name: marker_rows(structure, group).translation @ x for name, group in groups.items()}
    stretch = {name: rows.reshape(3, 4, 3) for name, rows in displacements.items()}
    return replace(
        body, markers={key: replace(m, stretch=stretch.get(key, m.stretch)) for key, m in body.markers.items()}
    )


def with_stretch_of_slaved(body: FlexibleBody, full_body: FlexibleBody, n: int) -> FlexibleBody:
    """A condensed straight beam on functions with the static stretch of its markers.

    full_body: the body before condensation, with dependent shapes from n on
    """
    V1, m = full_body.strain.V1, full_body.n_modes
    uniform, linear = full_body.moments.first[1 : 1 + m], full_body.moments.second[0][:, 1 : 1 + m]
    work = np.concatenate([uniform[:, None], linear.swapaxes(0, 1)], axis=1).reshape(m, 12)
    x = np.linalg.solve(V1, work)
    x[:n] -= np.linalg.solve(V1[:n, :n], work[:n])
    stretch = {key: (marker.phi[:, :m] @ x).reshape(3, 4, 3) for key, marker in full_body.markers.items()}
    return replace(body, markers={key: replace(marker, stretch=stretch[key]) for key, marker in body.markers.items()})


def static_stretch(structure: Structure, modes: ModeSet, phi: Array) -> Array:
    """Static displacements (n_dof, 12) [m, rad] in 12 fields z_a e_b of force per mass, outside the shapes phi."""
    load = loads_of_linear_accelerations(structure)
    response = static_response(structure, modes, load)
    x = response - phi @ np.linalg.solve(phi.T @ (structure.K @ phi), phi.T @ load)
    energy, size = (np.einsum("in,in->n", part, structure.K @ part) for part in (x, response))
    x[:, energy <= REPRESENTED * size] = 0.0
    return np.asarray(x)
