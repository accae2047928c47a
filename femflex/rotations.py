"""Rotations for people and files: angle sequences, Euler parameters (scalar first), rotation vectors, matrices.

C_AB turns components in B into components in A; every function speaks of C_PQ, a rotation that carries P onto Q. All
take stacks (..., 3, 3), (..., 4), (..., 3) and lean on scipy's Rotation; the compiled model has its own formulas in
femflex.dynamics.turns, tested against these.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

ANGLE_SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")


def checked_sequence(sequence: str) -> str:
    """The sequence itself, intrinsic, such as "xzy".

    Raises ValueError with the known ones for any other word.
    """
    if sequence not in ANGLE_SEQUENCES:
        raise ValueError(f"angle sequence {sequence!r} is not known; known are {list(ANGLE_SEQUENCES)}")
    return sequence


def dcm_from_angles(angles: ArrayLike, sequence: str) -> Array:
    """C_PQ (..., 3, 3) of intrinsic turns (..., 3) [rad] in a sequence such as "xzy".

    >>> dcm_from_angles([np.pi / 2, 0, 0], "xyz").round(12) @ [0, 1, 0]
    array([0., 0., 1.])
    """
    return Rotation.from_euler(checked_sequence(sequence).upper(), np.asarray(angles, float)).as_matrix()


def angles_from_dcm(C: ArrayLike, sequence: str) -> Array:
    """Intrinsic angles (..., 3) [rad] of C_PQ; at the sequence's singularity the third is zero."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        letters: Any = checked_sequence(sequence).upper()
        return Rotation.from_matrix(np.asarray(C, float)).as_euler(letters)


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
