"""Local axes of flat plate elements in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array

PLANE_TOLERANCE = 1e-6  # sine of the angle below which two plate facets count as one plane
ROUNDING = 1e-12  # components of a unit vector below this are rounding


def plane_normals(corners: Array, where: str) -> Array:
    """Unit normals (e, 3) [1] of elements from three of their corners (e, 3+, 3), signed by `orient_normals`.

    Raises ValueError when an element has no area. Normals that differ by rounding only are returned equal.
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    area = np.linalg.norm(normal, axis=1)
    flat = area <= ROUNDING * np.maximum(np.sum(a * a, axis=1), np.sum(b * b, axis=1))
    if flat.any():
        raise ValueError(
            f"{where}: {int(flat.sum())} of {len(area)} elements have no area, the first is element "
            f"{int(np.argmax(flat))} with corners {corners[np.argmax(flat)].tolist()}; repair the mesh"
        )
    unit = orient_normals(normal / area[:, None])
    coplanar = np.abs(unit - unit[0]).max() < ROUNDING
    return np.broadcast_to(unit[0], unit.shape) if coplanar else unit


def orient_normals(normals: Array) -> Array:
    """Unit normals (e, 3) [1] with the sign that makes z positive, or y where z is zero, or x; rounding errors become
    zero."""
    n = np.where(np.abs(normals) < ROUNDING, 0.0, normals)
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    x, y, z = (np.where(np.abs(c) < PLANE_TOLERANCE, 0.0, np.sign(c)) for c in n.T)
    return n * np.where(z != 0, z, np.where(y != 0, y, x))[:, None]


def same_side(normal: ArrayLike) -> bool:
    """Whether the normal of a plate equals this one (3,), which follows from the order of its corners, and not its
    opposite."""
    normals = np.asarray(normal, float)[None]
    return bool(np.sum(orient_normals(normals) * normals) > 0)


def in_plane(direction: ArrayLike, normals: Array) -> Array:
    """Unit vectors (e, 3) [1]: the direction (3,) projected onto each plane, or the direction with its components
    shifted if it is perpendicular to the plane."""
    vector = np.asarray(direction, float)
    first, second = _projected(vector / np.linalg.norm(vector), normals), _projected(np.roll(vector, 1), normals)
    perpendicular = np.linalg.norm(first, axis=1, keepdims=True) < 0.1
    projected = np.where(perpendicular, second, first)
    unit = projected / np.linalg.norm(projected, axis=1, keepdims=True)
    return np.where(np.abs(unit) < ROUNDING, 0.0, unit)


def plane_frames(normals: Array) -> Array:
    """Right-handed axes (e, 3, 3) of the planes, rows e1, e2, normal: e1 is the global x axis projected onto the
    plane."""
    first = in_plane([1.0, 0.0, 0.0], normals)
    return np.stack([first, np.cross(normals, first), normals], axis=1)


def shared_axes(axes: Array) -> Array:
    """Axes (1, 3, 3) [1] if all elements have the same, else the given ones (e, 3, 3)."""
    return axes[:1] if np.abs(axes - axes[0]).max() < ROUNDING else axes


def section_angles(axis: ArrayLike, frames: Array) -> Array:
    """Angles (e,) [rad] of a section's x axis in the elements' axes: the axis (3,), global, projected onto the
    planes."""
    direction = in_plane(axis, frames[:, 2])
    return np.arctan2(np.sum(direction * frames[:, 1], axis=1), np.sum(direction * frames[:, 0], axis=1))


def _projected(direction: Array, normals: Array) -> Array:
    return direction - normals * (normals @ direction)[:, None]
