"""Bodies at a marker of another body as part of it: their mass and rotary inertia in the body's moments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments

ROUNDING = 1e-9  # of the sum of second moments: digits of an inertia, as of a thin plate


def attached_moments(body: FlexibleBody, marker: str, mass: float, inertia: ArrayLike) -> MassMoments:
    """Moments over the body's shapes of a mass [kg] whose centre is the marker, with inertia (3, 3) [kg m^2] about it.

    inertia: in the marker's axes. Points of it at offsets e move by phi + psi x e (THEORY section 3). Either may be
    negative, for what is taken out of a body.
    """
    marker_ = body.marker(marker)
    J = marker_.orientation @ np.asarray(inertia, float) @ marker_.orientation.T
    Q = np.trace(J) / 2.0 * np.eye(3) - J
    places = np.concatenate([marker_.position[None], marker_.phi.T])  # A a
    turns = np.stack([np.eye(3), *(_skew(psi) for psi in marker_.psi.T)])  # A a e: of an offset e
    second = mass * np.einsum("Aa,Bb->AaBb", places, places) + np.einsum("Aae,ef,Bbf->AaBb", turns, Q, turns)
    return MassMoments(mass, mass * places, second)


def with_attached(body: FlexibleBody, marker: str, mass: float, inertia: ArrayLike) -> FlexibleBody:
    """The body with that mass and inertia at a marker.

    Raises ValueError where no positive inertia is left.
    """
    added, moments_before = attached_moments(body, marker, mass, inertia), body.moments
    moments = MassMoments(
        moments_before.mass + added.mass, moments_before.first + added.first, moments_before.second + added.second
    )
    if not moments.mass > 0.0:
        raise ValueError(
            f"without the mass removed at marker {marker!r} the body has {moments.mass:g} kg; it needs a positive mass"
        )
    if (least := least_second_moment(moments)) < 0.0:
        raise ValueError(
            f"without the inertia removed at marker {marker!r} the body has a second moment int x^2 dm of {least:.4g} "
            "kg m^2 along an axis: its inertia does not contain the removed one, so set that as added, or raise the "
            "body's inertia"
        )
    return replace(body, moments=moments)


def least_second_moment(moments: MassMoments) -> float:
    """Least second moment int x^2 dm along any axis x through the centre of mass [kg m^2], of no mass below zero.

    It is (J_y + J_z - J_x) / 2 of the principal inertias, so that it is negative where these break the triangle
    inequality. 0 where it is negative by rounding alone.
    """
    c = moments.center_of_mass()
    Q = moments.second[0, :, 0, :] - moments.mass * np.outer(c, c)
    least = float(np.linalg.eigvalsh(Q)[0])
    return least if abs(least) > ROUNDING * abs(float(np.trace(Q))) else 0.0


def _skew(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
