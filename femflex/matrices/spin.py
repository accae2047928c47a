"""Geometric stiffness that grows with the square of a body's rate about an axis.

An additional shape has the dependent amplitude y = 1/2 delta.G delta. Its only mass moments are P[s, a, 0, b] = B_ab =
e_a e_b - 1/2 delta_ab. In a rotating frame its inertia force is B : W = (omega.e)^2, W = omega omega^T - |omega|^2 1
(THEORY section 3), which gives the coordinates the stiffness (omega.e)^2 G. B is symmetric, so that accelerations of
the frame have no effect.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments


def with_spin_stiffness(body: FlexibleBody, G: Array, axis: ArrayLike) -> FlexibleBody:
    """The body with the stiffness (omega.e)^2 G of its n coordinates, G (n, n) [1/s^2 per (rad/s)^2], e the unit axis.

    Raises ValueError when the axis is zero.
    """
    e = np.asarray(axis, float)
    if not np.linalg.norm(e) > 0:
        raise ValueError(f"the axis of the spin is {e.tolist()}; give a direction")
    e = e / np.linalg.norm(e)
    n, moments = body.n_shapes, body.moments
    first, second = np.zeros((2 + n, 3)), np.zeros((2 + n, 3, 2 + n, 3))
    first[:-1], second[:-1, :, :-1] = moments.first, moments.second
    second[0, :, -1] = second[-1, :, 0] = np.outer(e, e) - np.eye(3) / 2
    no_motion = np.zeros((3, 1))
    skin = body.skin
    if skin is not None:
        skin = replace(skin, shapes=np.concatenate([skin.shapes, np.zeros((1, *skin.points.shape))]))
    return replace(
        body,
        moments=MassMoments(moments.mass, first, second),
        markers={
            name: replace(m, phi=np.column_stack([m.phi, no_motion]), psi=np.column_stack([m.psi, no_motion]))
            for name, m in body.markers.items()
        },
        skin=skin,
        kinds=(*body.kinds, "remainder"),
        omega=np.append(body.omega, np.nan),
        slaves=np.concatenate([body.slaves.reshape(-1, body.n_modes, body.n_modes), (G + G.T)[None] / 2]),
    )
