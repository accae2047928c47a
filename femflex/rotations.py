"""Rotations for people and files: angle sequences, Euler parameters (scalar first), Rodrigues and rotation vectors.

A rotation set is named "euler_parameters", "rodrigues" (Gibbs' vector, axis times tan(angle/2)), "modified_rodrigues"
(axis times tan(angle/4)), or an angle sequence: "intrinsic xzy" (or "xzy" alone) turns about x, then about the z that
turned with it, then about the y that turned twice; "extrinsic xzy" turns about the fixed x, z and y.

C_AB turns components in B into components in A. The functions use C_PQ, a rotation that carries P onto Q. All take
stacks (..., 3, 3), (..., 4), (..., 3) and use scipy's Rotation; the compiled model has its own formulas in
femflex.kernels.turns, tested against these.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from femflex.arrays import Array

ANGLE_SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")


INTRINSIC, EXTRINSIC = "intrinsic", "extrinsic"
NAMED_SEQUENCES = (*ANGLE_SEQUENCES, *(f"{kind} {s}" for kind in (INTRINSIC, EXTRINSIC) for s in ANGLE_SEQUENCES))
EULER_PARAMETERS, RODRIGUES, MODIFIED = "euler_parameters", "rodrigues", "modified_rodrigues"
ROTATION_SETS = (EULER_PARAMETERS, RODRIGUES, MODIFIED, *NAMED_SEQUENCES)
SINGULAR = 1e-6  # rad; closer to its singularity than this a set counts as singular


def checked_sequence(sequence: str) -> str:
    """The sequence itself, such as "xzy", "intrinsic xzy" or "extrinsic xzy".

    Raises ValueError with the known ones for any other word.
    """
    if sequence not in NAMED_SEQUENCES:
        raise ValueError(
            f"angle sequence {sequence!r} is not known; known are {list(ANGLE_SEQUENCES)}, each also as "
            f"'intrinsic xyz' (the same) or 'extrinsic xyz'"
        )
    return sequence


def letters_of(sequence: str) -> str:
    """The axes of a sequence in the order of its turns: "extrinsic xzy" gives "xzy"."""
    return checked_sequence(sequence)[-3:]


def is_extrinsic(sequence: str) -> bool:
    """Whether the turns of a sequence are about fixed axes."""
    return checked_sequence(sequence).startswith(EXTRINSIC)


def is_symmetric(sequence: str) -> bool:
    """Whether the first and the last turn of a sequence are about the same axis letter, as in "zxz"."""
    letters = letters_of(sequence)
    return letters[0] == letters[2]


def dcm_from_angles(angles: ArrayLike, sequence: str) -> Array:
    """C_PQ (..., 3, 3) of turns (..., 3) [rad] in the order of a sequence such as "xzy" or "extrinsic xzy".

    >>> dcm_from_angles([np.pi / 2, 0, 0], "xyz").round(12) @ [0, 1, 0]
    array([0., 0., 1.])
    """
    return Rotation.from_euler(_scipy_letters(sequence), np.asarray(angles, float)).as_matrix()


def angles_from_dcm(C: ArrayLike, sequence: str) -> Array:
    """Angles (..., 3) [rad] of C_PQ; at the sequence's singularity the third is zero."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        letters: Any = _scipy_letters(sequence)
        return Rotation.from_matrix(np.asarray(C, float)).as_euler(letters)


def _scipy_letters(sequence: str) -> str:
    return letters_of(sequence) if is_extrinsic(sequence) else letters_of(sequence).upper()


def dcm_from_quaternion(e: ArrayLike) -> Array:
    """C_PQ (..., 3, 3) of Euler parameters (..., 4), which need not be normalised."""
    return Rotation.from_quat(np.asarray(e, float), scalar_first=True).as_matrix()


def quaternion_from_dcm(C: ArrayLike) -> Array:
    """Euler parameters (..., 4) of C_PQ, scalar part not negative."""
    return Rotation.from_matrix(np.asarray(C, float)).as_quat(canonical=True, scalar_first=True)


def dcm_from_vector(theta: ArrayLike) -> Array:
    """C_PQ = exp(skew(theta)) (..., 3, 3) of rotation vectors (..., 3) [rad]."""
    return Rotation.from_rotvec(np.asarray(theta, float)).as_matrix()


def vector_from_dcm(C: ArrayLike) -> Array:
    """Rotation vectors (..., 3) [rad] of C_PQ, of length at most pi."""
    return Rotation.from_matrix(np.asarray(C, float)).as_rotvec()


def dcm_from_coordinates(coordinates: ArrayLike, rotation: str) -> Array:
    """C_PQ (..., 3, 3) of coordinates (..., 4 | 3) in a rotation set.

    >>> dcm_from_coordinates([0.0, 0.0, 1.0], "rodrigues").round(12) @ [1, 0, 0]
    array([0., 1., 0.])
    """
    q = np.asarray(coordinates, float)
    if rotation == RODRIGUES:
        return dcm_from_quaternion(np.concatenate([np.ones_like(q[..., :1]), q], axis=-1))
    if rotation == MODIFIED:
        return dcm_from_quaternion(np.concatenate([1.0 - (q**2).sum(-1, keepdims=True), 2.0 * q], axis=-1))
    return dcm_from_quaternion(q) if rotation == EULER_PARAMETERS else dcm_from_angles(q, rotation)


def coordinates_from_dcm(C: ArrayLike, rotation: str) -> Array:
    """Coordinates (..., 4 | 3) of C_PQ in a rotation set; Gibbs' vector of a half turn is infinite."""
    if rotation in (RODRIGUES, MODIFIED):
        e = quaternion_from_dcm(C)
        with np.errstate(divide="ignore", invalid="ignore"):
            return e[..., 1:] / (e[..., :1] + (1.0 if rotation == MODIFIED else 0.0))
    return quaternion_from_dcm(C) if rotation == EULER_PARAMETERS else angles_from_dcm(C, rotation)


def singularity_distance(coordinates: ArrayLike, rotation: str) -> Array:
    """Angle (...) [rad] to the singularity of a rotation set at coordinates (..., 3).

    Angle sequences: the second angle's distance from a quarter turn, or from zero and half turns when the first and
    third axis are alike (at most pi/2). Gibbs' vector: pi less the angle of rotation; modified: 2 pi less it.
    Infinite for Euler parameters, which have no singularity.
    """
    q = np.asarray(coordinates, float)
    if rotation == EULER_PARAMETERS:
        return np.full(q.shape[:-1], np.inf)
    if rotation in (RODRIGUES, MODIFIED):
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.arctan(1.0 / np.linalg.norm(q, axis=-1))
        return (2.0 if rotation == RODRIGUES else 4.0) * np.where(np.isfinite(q).all(-1), distance, 0.0)
    turn = np.sin(q[..., 1]) if is_symmetric(rotation) else np.cos(q[..., 1])
    return np.arcsin(np.abs(turn))


def continued_angles(angles: ArrayLike, symmetric: bool) -> Array:
    """Angles (n_t, 3) [rad] of a sequence, each row replaced by the equivalent one nearest to the row before.

    (a, b, c), (a + pi, pi - b, c + pi) and whole turns more of each are the same rotation; so is (a + pi, -b, c + pi)
    in place of the second where the first and the third axis are alike (symmetric). Where the sequence is singular, a
    and c are not unique: they are interpolated between the neighbouring rows.

    >>> continued_angles(np.radians([[0, 80, 0], [180, 80, 180], [180, -10, -180]]), False) * 180 / np.pi
    array([[  0.,  80.,   0.],
           [  0., 100.,   0.],
           [  0., 190.,   0.]])
    """
    all_angles = np.asarray(angles, float)
    middle = all_angles[:, 1]
    rows = np.flatnonzero(np.abs(np.sin(middle) if symmetric else np.cos(middle)) > SINGULAR)
    if not len(rows):
        return all_angles
    regular = all_angles[rows]
    alternative = np.array([np.pi, 0.0 if symmetric else np.pi, np.pi]) + regular * [1.0, -1.0, 1.0]
    jumps, mirrored_jumps = (
        np.square(np.angle(np.exp(1j * (later[1:] - regular[:-1])))).sum(axis=1) for later in (regular, alternative)
    )
    swapped = np.concatenate([[False], np.cumsum(mirrored_jumps < jumps) % 2 == 1])
    unwrapped = np.unwrap(np.where(swapped[:, None], alternative, regular), axis=0)
    a, b, c = (np.interp(np.arange(len(all_angles)), rows, column) for column in unwrapped.T)
    return np.stack(
        [a, np.where(np.isin(np.arange(len(all_angles)), rows), b, b + np.angle(np.exp(1j * (middle - b)))), c], 1
    )


def regular_coordinates(rotation: str) -> Array:
    """Coordinates (3,) farthest from the singularity of a rotation set, where a re-based set starts."""
    symmetric = rotation in NAMED_SEQUENCES and is_symmetric(rotation)
    return np.array([0.0, np.pi / 2 if symmetric else 0.0, 0.0])
