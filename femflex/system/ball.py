"""Balls: the coordinates of a joint that turns freely, in a rotation set, and faults in the choice of this set."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from femflex.arrays import Array
from femflex.rotations import (
    ANGLE_SEQUENCES,
    EULER_PARAMETERS,
    MODIFIED,
    NAMED_SEQUENCES,
    RODRIGUES,
    ROTATION_SETS,
    SINGULAR,
    coordinates_from_dcm,
    dcm_from_angles,
    dcm_from_coordinates,
    is_extrinsic,
    letters_of,
    quaternion_from_dcm,
    regular_coordinates,
    singularity_distance,
)

NEAR = np.pi / 4  # rad; a re-based set closer to its singularity than this begins anew from a new reference


def check_ball(rotation: str | None, rebase: bool, label: str) -> None:
    """Raise ValueError for a rotation set of joint `label` that is not known, or that needs no re-basing."""
    if rotation is not None and rotation not in ROTATION_SETS:
        raise ValueError(
            f"rotation set {rotation!r} of joint {label!r} is not known; known are "
            f"{[EULER_PARAMETERS, RODRIGUES, MODIFIED, *ANGLE_SEQUENCES]}, and 'intrinsic xyz', 'extrinsic xyz'"
        )
    if rebase and rotation is None:
        raise ValueError(f"joint {label!r} is to be re-based, but has no rotation set; only a ball has one")
    if rebase and rotation in (EULER_PARAMETERS, MODIFIED):
        why = "has no singularity" if rotation == EULER_PARAMETERS else "switches to its shadow by itself"
        raise ValueError(
            f"joint {label!r} is to be re-based, but its rotation set {rotation!r} {why}; leave `rebase` out, or "
            f"choose an angle sequence or {RODRIGUES!r}"
        )


def singular_start(rotation: str, coordinates: Array, label: str) -> str | None:
    """Return the message that joint `label` starts at the singularity of its rotation set, "" if it does not."""
    if singularity_distance(coordinates, rotation) > SINGULAR:
        return None
    return (
        f"joint {label!r} starts at the singularity of its rotation set {rotation!r}, at coordinates "
        f"{np.asarray(coordinates).round(9).tolist()}; choose another set, such as {EULER_PARAMETERS!r}, set "
        f"rebase, or start elsewhere"
    )


def ball_coordinates(rotation: str, sequence: str, angles: Array, rebase: bool = False) -> Array:
    """Coordinates of a ball with that rotation set, turned by angles [rad] of a sequence.

    rebase: with those of its reference, which is P unless the ball is near its singularity there.

    >>> ball_coordinates("euler_parameters", "xyz", np.zeros(3))
    array([1., 0., 0., 0.])
    """
    return _ball_coordinates(rotation, sequence, tuple(np.asarray(angles, float).tolist()), rebase).copy()


@lru_cache(maxsize=64)  # joints of a craft start alike, and so do those of the members of a sweep
def _ball_coordinates(rotation: str, sequence: str, angles: tuple[float, ...], rebase: bool) -> Array:
    C_PQ = dcm_from_angles(np.array(angles), sequence)
    q = coordinates_from_dcm(C_PQ, rotation)
    if not rebase:
        return q
    if singularity_distance(q, rotation) > NEAR:
        return np.concatenate([q, [1.0, 0.0, 0.0, 0.0]])
    q = regular_coordinates(rotation)
    return np.concatenate([q, quaternion_from_dcm(C_PQ @ dcm_from_coordinates(q, rotation).T)])


def ball_names(rotation: str) -> list[tuple[str, str]]:
    """Name and unit of the three coordinates of a rotation set other than Euler parameters."""
    if rotation in NAMED_SEQUENCES:
        first = "fixed_" if is_extrinsic(rotation) else ""
        return [(f"{first}{axis}{j + 1}", "rad") for j, axis in enumerate(letters_of(rotation))]
    return [(f"{'g' if rotation == RODRIGUES else 'p'}{j + 1}", "1") for j in range(3)]
