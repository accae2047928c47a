"""What stands at a marker of a body as part of it: its mass and rotary inertia in the body's moments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments


def attached_moments(body: FlexibleBody, marker: str, mass: float, inertia: ArrayLike) -> MassMoments:
    """Moments over the body's shapes of a mass [kg] whose centre is the marker, with inertia (3, 3) [kg m^2] about it.

    inertia: in the marker's axes. Points of it at offsets e move by phi + psi x e (THEORY section 3). Either may be
    negative, for what is taken out of a body.
    """
    at = body.marker(marker)
    J = at.orientation @ np.asarray(inertia, float) @ at.orientation.T
    Q = np.trace(J) / 2.0 * np.eye(3) - J
    places = np.concatenate([at.position[None], at.phi.T])  # A a
    turns = np.stack([np.eye(3), *(_skew(psi) for psi in at.psi.T)])  # A a e: of an offset e
    second = mass * np.einsum("Aa,Bb->AaBb", places, places) + np.einsum("Aae,ef,Bbf->AaBb", turns, Q, turns)
    return MassMoments(mass, mass * places, second)


def with_attached(body: FlexibleBody, marker: str, mass: float, inertia: ArrayLike) -> FlexibleBody:
    """The body with that mass and inertia at a marker.

    Raises ValueError where no positive inertia is left.
    """
    more, own = attached_moments(body, marker, mass, inertia), body.moments
    moments = MassMoments(own.mass + more.mass, own.first + more.first, own.second + more.second)
    if not moments.mass > 0.0:
        raise ValueError(
            f"without the mass removed at marker {marker!r} the body has {moments.mass:g} kg; it needs a positive mass"
        )
    if (least := least_inertia(moments)) < 0.0:
        raise ValueError(
            f"without the inertia removed at marker {marker!r} the body has a principal inertia of {least:.4g} kg m^2: "
            "its inertia does not contain the removed one, so set that as added"
        )
    return replace(body, moments=moments)


def least_inertia(moments: MassMoments) -> float:
    """Least principal inertia about the centre of mass [kg m^2]; 0 where it is negative by rounding alone."""
    c = moments.center_of_mass()
    J = moments.inertia() - moments.mass * (c @ c * np.eye(3) - np.outer(c, c))
    least = float(np.linalg.eigvalsh(J)[0])
    return least if abs(least) > 1e-12 * abs(float(np.trace(J))) else 0.0


def _skew(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
