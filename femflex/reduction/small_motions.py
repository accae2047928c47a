"""Structure and shapes -> FlexibleBody for small motions about rest alone, of which it has what these need.

From such bodies the shapes that a body is to keep are chosen; the body itself is made once they are known.
"""

from __future__ import annotations

from collections.abc import Container, Mapping

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import marker, marker_rows
from femflex.reduction.inertia.accelerations import loads_of_rigid_accelerations
from femflex.reduction.inertia.mass_points import mass_points
from femflex.reduction.inertia.moments import linear_stiffness, mass_moments
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.reduce import skin_of

LEVI_CIVITA = np.array([[np.cross(a, b) for b in np.eye(3)] for a in np.eye(3)]).transpose(2, 0, 1)


def small_motion_body(
    structure: Structure,
    modes: ModeSet,
    markers: Mapping[str, str] | None = None,
    turning: Container[str] | None = None,
) -> FlexibleBody:
    """The FlexibleBody of a structure that moves a little about rest in these shapes, undamped; arguments as of
    `reduce_structure`."""
    places = {**{group: group for group in modes.groups}, **(markers or {})}
    rigid = mass_moments(structure.inertia, np.zeros((structure.T.shape[0], 0)))
    at = {
        name: marker(marker_rows(structure, group), modes.phi, name, turning is None or name in turning)
        for name, group in places.items()
    }
    body = in_shapes(structure, modes.phi, rigid, at)
    return FlexibleBody(
        moments=body.moments,
        strain=body.strain,
        damping=body.damping,
        markers=at,
        skin=skin_of(structure, modes.phi),
        kinds=modes.kinds,
        omega=modes.omega,
        mass_points=mass_points(structure, modes.phi),
    )


def in_shapes(structure: Structure, phi: Array, rigid: MassMoments, markers: Mapping[str, Marker]) -> FlexibleBody:
    """A body in shapes phi (n_dof, n) with these markers; of its moments what small motions about rest need.

    rigid: moments of the undeformed body, alone or with those of shapes, which are left out.
    """
    n = phi.shape[1]
    pull = loads_of_rigid_accelerations(structure).T @ phi  # momentum (3, n) and angular momentum (3, n) per shape
    second = np.zeros((1 + n, 3, 1 + n, 3))
    second[0, :, 0, :] = rigid.second[0, :, 0, :]
    turned = np.einsum("abc,ak->bkc", LEVI_CIVITA, pull[3:]) / 2
    second[0, :, 1:, :] = turned
    second[1:, :, 0, :] = turned.transpose(1, 2, 0)
    Me = phi.T @ (structure.M @ phi)
    second[1:, :, 1:, :] = np.einsum("kl,ab->kalb", Me, np.eye(3)) / 3
    return FlexibleBody(
        moments=MassMoments(rigid.mass, np.vstack([rigid.first[:1], pull[:3].T]), second),
        strain=StrainTensors.linear(linear_stiffness(structure.K, phi)),
        damping=np.zeros((n, n)),
        markers=dict(markers),
    )
