"""Reduce a Structure to a FlexibleBody that is valid only for small motions about rest.

The static shapes of a body are selected with such bodies; the body itself is built once its shapes are known.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors
from femflex.fem.static_loads import StaticLoads
from femflex.fem.structure import Structure
from femflex.reduction.induced_strain import with_induced_strains
from femflex.reduction.inertia.accelerations import loads_of_rigid_accelerations
from femflex.reduction.inertia.moments import linear_stiffness, mass_moments, mass_points
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.reduce import attachments, skin_of

LEVI_CIVITA = np.array([[np.cross(a, b) for b in np.eye(3)] for a in np.eye(3)]).transpose(2, 0, 1)


def small_motion_body(
    structure: Structure,
    modes: ModeSet,
    markers: Mapping[str, str] | None = None,
    turning: Container[str] | None = None,
    patches: Sequence[str] = (),
    loads: Mapping[str, StaticLoads] | None = None,
    induced: Sequence[str] = (),
) -> FlexibleBody:
    """The undamped FlexibleBody of a structure for small motions about rest; arguments as of `reduce_structure`."""
    groups = {**{group: group for group in modes.groups}, **(markers or {})}
    rigid = mass_moments(structure.inertia, np.zeros((structure.T.shape[0], 0)))
    body_markers, body_patches, load_sets = attachments(structure, modes.phi, groups, turning, patches, loads, True)
    draft = replace(
        body_of_shapes(structure, modes.phi, rigid, body_markers),
        skin=skin_of(structure, modes.phi),
        kinds=modes.kinds,
        omega=modes.omega,
        mass_points=mass_points(structure, modes.phi),
        patches=body_patches,
        load_sets=load_sets,
    )
    return with_induced_strains(structure, modes, draft, induced, np.arange(draft.n_modes))


def body_of_shapes(structure: Structure, phi: Array, rigid: MassMoments, markers: Mapping[str, Marker]) -> FlexibleBody:
    """A body of shapes phi (n_dof, n) [m, rad] with these markers, and the moments that small motions about rest need.

    rigid: moments of the undeformed body; moments of shapes in it are ignored.
    """
    n = phi.shape[1]
    momenta = loads_of_rigid_accelerations(structure).T @ phi  # momentum (3, n) and angular momentum (3, n) per shape
    second = np.zeros((1 + n, 3, 1 + n, 3))
    second[0, :, 0, :] = rigid.second[0, :, 0, :]
    half_moments = np.einsum("abc,ak->bkc", LEVI_CIVITA, momenta[3:]) / 2
    second[0, :, 1:, :] = half_moments
    second[1:, :, 0, :] = half_moments.transpose(1, 2, 0)
    Me = phi.T @ (structure.M @ phi)
    second[1:, :, 1:, :] = np.einsum("kl,ab->kalb", Me, np.eye(3)) / 3
    return FlexibleBody(
        moments=MassMoments(rigid.mass, np.vstack([rigid.first[:1], momenta[:3].T]), second),
        strain=StrainTensors.linear(linear_stiffness(structure.K, phi)),
        damping=np.zeros((n, n)),
        markers=dict(markers),
    )
