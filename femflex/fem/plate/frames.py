"""Local axes of flat plate elements in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array

PLANE_TOLERANCE = 1e-6  # sine of the angle below which two plate facets count as one plane
DUST = 1e-12  # components of a unit vector below this are rounding


def plane_normals(corners: Array, where: str) -> Array:
    """Unit normals (e, 3) [1] of elements from three of their corners (e, 3+, 3), turned by `oriented`.

    Raises ValueError when an element has no area. Normals that are equal but for rounding come back equal.
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    area = np.linalg.norm(normal, axis=1)
    flat = area <= DUST * np.maximum(np.sum(a * a, axis=1), np.sum(b * b, axis=1))
    if flat.any():
        raise ValueError(
            f"{where}: {int(flat.sum())} of {len(area)} elements have no area, the first is element "
            f"{int(np.argmax(flat))} with corners {corners[np.argmax(flat)].tolist()}; repair the mesh"
        )
    unit = oriented(normal / area[:, None])
    one = np.abs(unit - unit[0]).max() < DUST
    return np.broadcast_to(unit[0], unit.shape) if one else unit


def oriented(normals: Array) -> Array:
    """Unit normals (e, 3) [1] turned so that z is positive, or y where z vanishes, or x; rounding dust becomes zero."""
    n = np.where(np.abs(normals) < DUST, 0.0, normals)
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    x, y, z = (np.where(np.abs(c) < PLANE_TOLERANCE, 0.0, np.sign(c)) for c in n.T)
    return n * np.where(z != 0, z, np.where(y != 0, y, x))[:, None]


def same_side(normal: ArrayLike) -> bool:
    """Whether a plate's normal is this one (3,), that of the order of its corners, and not the opposite."""
    own = np.asarray(normal, float)[None]
    return bool(np.sum(oriented(own) * own) > 0)


def in_plane(direction: ArrayLike, normals: Array) -> Array:
    """Unit vectors (e, 3) [1]: the direction (3,) laid into each plane; where it is upright, with components
    shifted."""
    given = np.asarray(direction, float)
    first, second = _laid(given / np.linalg.norm(given), normals), _laid(np.roll(given, 1), normals)
    upright = np.linalg.norm(first, axis=1, keepdims=True) < 0.1
    chosen = np.where(upright, second, first)
    unit = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    return np.where(np.abs(unit) < DUST, 0.0, unit)


def plane_frames(normals: Array) -> Array:
    """Right-handed axes (e, 3, 3) of the planes, rows e1, e2, normal: e1 is the global x axis laid into the plane."""
    first = in_plane([1.0, 0.0, 0.0], normals)
    return np.stack([first, np.cross(normals, first), normals], axis=1)


def shared_axes(axes: Array) -> Array:
    """Axes (1, 3, 3) [1] where all elements have the same, else as they are (e, 3, 3)."""
    return axes[:1] if np.abs(axes - axes[0]).max() < DUST else axes


def section_angles(axis: ArrayLike, frames: Array) -> Array:
    """Angles (e,) [rad] of a section's x axis in the elements' axes: the axis (3,), global, laid into the planes."""
    direction = in_plane(axis, frames[:, 2])
    return np.arctan2(np.sum(direction * frames[:, 1], axis=1), np.sum(direction * frames[:, 0], axis=1))


def _laid(direction: Array, normals: Array) -> Array:
    return direction - normals * (normals @ direction)[:, None]
