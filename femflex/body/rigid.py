"""A body without shapes, from its mass and inertia."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.body.flexible import FlexibleBody
from femflex.body.marker import Marker
from femflex.body.moments import MassMoments
from femflex.body.skin import Skin
from femflex.body.strain import StrainTensors


def rigid_body(
    mass: float,
    inertia: Array | None = None,
    center_of_mass: Array | None = None,
    markers: dict[str, Marker] | None = None,
    skin: Skin | None = None,
) -> FlexibleBody:
    """A body without shapes from its mass [kg] and inertia about its centre of mass (3, 3) [kg m^2].

    inertia: or its principal moments (3,) along the axes of the body. Without it the mass is a point, whose rotation
        other bodies or the joints must constrain

    Raises ValueError when it has another shape, is not symmetric, not positive, or breaks the triangle inequality.
    """
    J = np.zeros(3) if inertia is None else np.asarray(inertia, float)
    if J.shape not in ((3,), (3, 3)):
        raise ValueError(f"inertia has shape {J.shape}; give three principal moments, or (3, 3), in kg m^2")
    J = np.diag(J) if J.ndim == 1 else J
    c = np.zeros(3) if center_of_mass is None else np.asarray(center_of_mass, float)
    if not mass > 0:
        raise ValueError(f"mass is {mass} kg; a body needs a positive mass")
    if not np.allclose(J, J.T, rtol=1e-9, atol=0):
        raise ValueError(f"inertia is not symmetric: {J.tolist()}")
    principal = np.linalg.eigvalsh(J)
    if principal[0] < 0:
        raise ValueError(f"inertia is not positive: its principal moments are {principal.tolist()} kg m^2")
    if principal[0] + principal[1] < principal[2] * (1 - 1e-9):
        raise ValueError(
            f"inertia breaks the triangle inequality: principal moments {principal.tolist()} kg m^2, "
            f"of which the two smaller must sum to at least the largest"
        )
    Q = np.trace(J) / 2 * np.eye(3) - J + mass * np.outer(c, c)
    moments = MassMoments(float(mass), (mass * c)[None, :], Q[None, :, None, :])
    empty = np.zeros((0, 0))
    return FlexibleBody(moments, StrainTensors.linear(empty), empty, dict(markers or {}), skin)
