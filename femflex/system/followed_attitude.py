"""Attitudes over time as three turns about axes that stay far from their singularity."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.rotations import dcm_from_quaternion
from femflex.system.ccsds import read_aem
from femflex.system.profile import Profile

SECONDS = 86400.0
LEAST = 0.1  # of the cosine of the middle angle, below which axes are not taken
ENOUGH = 0.5  # with which the axes of a sequence of letters are taken
TRIED = 2000  # triads of axes


def followed_angles(
    path: Path, epoch: float, duration: float, C_BM: Array
) -> tuple[Array, tuple[Profile, Profile, Profile]]:
    """Axes (3, 3), a row each, of three turns and their angles over time [rad], from inertial axes to a marker's.

    epoch [days since J2000] of t = 0; C_BM (3, 3) axes of the marker in the body. The second turn stays within 84 deg.
    Raises ValueError for a file that does not cover the duration [s], and where no axes are found.
    """
    message = read_aem(path)
    seconds = (message.days - epoch) * SECONDS
    if seconds[0] > 1e-3 or seconds[-1] < duration - 1e-3:
        raise ValueError(
            f"{path.name} goes from {seconds[0]:.6g} to {seconds[-1]:.6g} s of the run, which lasts {duration:.6g} s; "
            "give one that covers it, another environment.epoch, or a shorter run"
        )
    C = dcm_from_quaternion(message.values) @ C_BM
    margin, axes = _farthest(C, [np.eye(3)[list(order)] for order in permutations(range(3))])
    if margin < ENOUGH:
        q = np.random.default_rng(1).normal(size=(TRIED, 4))
        margin, axes = _farthest(C, [axes, *dcm_from_quaternion(q / np.linalg.norm(q, axis=1)[:, None])])
    if margin < LEAST:
        raise ValueError(
            f"the attitudes of {path.name} come near the singularity of any three turns (cosine {margin:.2g}, limit "
            f"{LEAST:g}); follow them in parts"
        )
    x, y, z = (Profile.spline(seconds, column, degree=5) for column in _angles(C, axes).T)
    return axes, (x, y, z)


def _farthest(C: Array, triads: list[Array]) -> tuple[float, Array]:
    """The triad of axes for which the least cosine of the middle angle is largest, and that cosine."""
    rows = np.array(triads)
    third = np.einsum("nab,mb->nma", C, rows[:, 2])
    cosines = np.sqrt(np.maximum(0.0, 1.0 - np.einsum("nma,ma->nm", third, rows[:, 0]) ** 2)).min(axis=0)
    best = int(np.argmax(cosines))
    return float(cosines[best]), rows[best]


def _angles(C: Array, axes: Array) -> Array:
    """Continuous angles (n, 3) [rad] of C = R(a, first) R(b, middle) R(c, last) about the axes a, b, c (rows)."""
    D = axes @ C @ axes.T
    sign = np.linalg.det(axes)
    first = np.arctan2(-sign * D[:, 1, 2], D[:, 2, 2])
    middle = np.arctan2(sign * D[:, 0, 2], np.hypot(D[:, 0, 0], D[:, 0, 1]))
    last = np.arctan2(-sign * D[:, 0, 1], D[:, 0, 0])
    return np.unwrap(np.column_stack([first, middle, last]), axis=0)
