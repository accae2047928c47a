"""Motion of a body in slices along its longest direction: flap, lag, stretch, torsion, chordwise; names of its shapes.

The mean motion of a slice is flap along an axis, lag across it and stretch along the body; turning about the body's
line is torsion, and what is left bends the slice (chordwise).
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.body.flexible import FlexibleBody

DEFORMATIONS = ("flap", "lag", "stretch", "torsion", "chordwise")
SLICES = 16
MAX_POINTS = 400  # points of a body that are looked at
PARALLEL = 0.9  # cosine between spin axis and body from which on it spins about its own line
AXIS_SHARE = 0.15  # of the square of a motion: an axis with less does not name its direction
ORDINALS = {1: "st", 2: "nd", 3: "rd"}


def shape_names(body: FlexibleBody, modes: Array | None = None) -> tuple[str, ...]:
    """Names (m,) of shapes of a body, such as "1st bending z" and "2nd torsion", in axes of the body.

    A bending that moves along two axes has both ("1st bending yz"). Empty texts where fewer than two points are known.

    modes: (n_modes, m) amplitudes of the elastic coordinates in each shape; default one coordinate each
    """
    modes = np.eye(body.n_modes) if modes is None else modes
    count = modes.shape[1]
    rest, shapes = points_of(body)
    if not count or len(rest) < 2:
        return ("",) * count
    moved = np.einsum("spa,sk->kpa", shapes[: body.n_modes], modes, optimize=True)
    shares, across = slice_shares(rest, moved.astype(complex), None)
    words = []
    for k in range(count):
        bends = shares[k, :2].sum() >= shares[k, 2:].max()
        direction = f" {direction_letters(across[k])}" if bends else ""
        words.append(f"bending{direction}".strip() if bends else DEFORMATIONS[int(np.argmax(shares[k]))])
    return tuple(f"{ordinal(words[: k + 1].count(word))} {word}" for k, word in enumerate(words))


def ordinal(number: int) -> str:
    """The number as a word of order.

    >>> ordinal(1), ordinal(2), ordinal(11), ordinal(23)
    ('1st', '2nd', '11th', '23rd')
    """
    return f"{number}{'th' if number % 100 in (11, 12, 13) else ORDINALS.get(number % 10, 'th')}"


def direction_letters(squares: Array) -> str:
    """The axes along which most of a motion goes, for its mean squares (3,) along x, y and z; empty for all three.

    >>> direction_letters(np.array([0.0, 0.1, 0.9])), direction_letters(np.array([0.0, 0.5, 0.5]))
    ('z', 'yz')
    """
    large = squares >= AXIS_SHARE * squares.sum()
    return "" if large.all() else "".join(letter for letter, flag in zip("xyz", large, strict=True) if flag)


def points_of(body: FlexibleBody) -> tuple[Array, Array]:
    """Return points (p, 3) of a body and their motion by its shapes (n_shapes, p, 3).

    Six points of the same inertia for a rigid body; some of the skin of a flexible one, or its markers.
    """
    if not body.n_shapes:
        return _inertia_points(body), np.zeros((0, 6, 3))
    if body.skin is not None and len(body.skin.points):
        chosen = slice(None, None, max(1, len(body.skin.points) // MAX_POINTS))
        return body.skin.points[chosen], body.skin.shapes[:, chosen]
    markers = list(body.markers.values())
    return np.stack([m.position for m in markers]), np.stack([m.phi.T for m in markers], axis=1)


def _inertia_points(body: FlexibleBody) -> Array:
    """Six points (6, 3) of a sixth of a rigid body's mass each that have its inertia."""
    centre = body.moments.center_of_mass()
    covariance = body.moments.second[0, :, 0, :] / body.moments.mass - np.outer(centre, centre)
    square, axes = np.linalg.eigh(covariance)
    arms = (np.sqrt(3.0 * np.maximum(square, 0.0)) * axes).T
    return np.concatenate([centre + arms, centre - arms])


def slice_shares(points: Array, motion: ComplexArray, axis: Array | None) -> tuple[Array, Array]:
    """Mean squares (n, 5) of the motion (n, p, 3) of a body's points in each of DEFORMATIONS, and (n, 3) along x, y, z.

    Those along the axes are of the slices' mean motion across the line. axis: of flap; default the axis of the motion's
    components that is farthest from the line.
    """
    centred = points - points.mean(axis=0)
    line = np.linalg.svd(centred, full_matrices=False)[2][0] if len(points) > 1 else np.eye(3)[0]
    if len(points) == 1 or not np.abs(centred).max() > 0:  # a point has no line: what is not flap is lag
        line = np.zeros(3)
    axis = np.eye(3)[int(np.argmin(np.abs(line)))] if axis is None else axis / np.linalg.norm(axis)
    flap = axis - line * (line @ axis)
    flap = np.zeros(3) if np.linalg.norm(flap) < np.sqrt(1 - PARALLEL**2) else flap / np.linalg.norm(flap)
    coordinate = centred @ line
    width = np.ptp(coordinate) or 1.0
    index = np.minimum((SLICES * (coordinate - coordinate.min()) / width).astype(int), SLICES - 1)
    out, across = np.zeros((len(motion), len(DEFORMATIONS))), np.zeros((len(motion), 3))
    for k in np.unique(index):
        inside = index == k
        u, arm = motion[:, inside], centred[inside] - centred[inside].mean(axis=0)
        arm = arm - np.outer(arm @ line, line)
        out += inside.sum() * np.stack(_mean_squares(u, arm, line, flap), axis=1)
        mean = u.mean(axis=1)
        across += inside.sum() * np.abs(mean - np.outer(mean @ line, line)) ** 2
    return out / len(points), across / len(points)


def _mean_squares(u: ComplexArray, arm: Array, line: Array, flap: Array) -> list[Array]:
    """Mean square (n,) of the motion u (n, p, 3) of one slice: DEFORMATIONS in turn."""
    mean = u.mean(axis=1)
    size = np.sum(np.abs(mean) ** 2, axis=1)
    along_flap, along_line = np.abs(mean @ flap) ** 2, np.abs(mean @ line) ** 2
    turn = np.cross(line, arm)
    inertia = float(np.sum(turn**2))
    theta = np.einsum("npa,pa->n", u, turn) / inertia if inertia > 0 else np.zeros(len(u))
    remaining = u - mean[:, None] - theta[:, None, None] * turn
    remaining = remaining - np.einsum("npa,a->np", remaining, line)[:, :, None] * line  # turned slices of a bent body
    twisted = np.abs(theta) ** 2 * inertia / len(arm)
    return [
        along_flap,
        size - along_flap - along_line,
        along_line,
        twisted,
        np.sum(np.abs(remaining) ** 2, axis=(1, 2)) / len(arm),
    ]
