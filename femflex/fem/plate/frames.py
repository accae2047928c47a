"""Local axes of flat plate elements in space, and elastic matrices of plate sections in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.fem.family import Option, Options
from femflex.fem.sections.laminates import PlateSection, strain_rotation

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


def _projected(direction: Array, normals: Array) -> Array:
    return direction - normals * (normals @ direction)[:, None]


OPTIONS: Options = {  # of all plates
    "axis": Option((1.0, 0.0, 0.0), "direction of the section's x axis, projected onto the plates", "", (3,)),
    "prestress": Option(None, "initial membrane forces xx, yy, xy in the section's axes", "N/m", (3,)),
    "thermal_strain": Option(None, "free strain, a number or xx, yy, xy in the section's axes", "", (0, 3)),
}


@dataclass(frozen=True, eq=False)
class Stiffness:
    """A, D (1|e, 3, 3) and S (1|e, 2, 2) of a section in the axes of elements; one matrix where all are alike."""

    A: Array
    D: Array
    S: Array

    def matrix(self, shears: bool) -> Array:
        """diag(A, D[, S]) (1|e, 1, 6|8, 6|8) over membrane strains, curvatures and, if it shears, shear strains."""
        n = 8 if shears else 6
        C = np.zeros((len(self.A), 1, n, n))
        C[:, 0, :3, :3], C[:, 0, 3:6, 3:6] = self.A, self.D
        if shears:
            C[:, 0, 6:, 6:] = self.S
        return C


def section_stiffness(section: PlateSection, axis: ArrayLike, axes: Array) -> Stiffness:
    """Stiffness [N/m, N, N m] of the section in axes (1|e, 3, 3) when its x axis is `axis` (3,), global, projected onto
    the planes.

    Raises ValueError when axis is not a direction.
    """
    return Stiffness(*section.stiffness(_angles(axis, axes)))


def ply_stiffness(section: PlateSection, axis: ArrayLike, axes: Array) -> Array:
    """Stress of plies (1|e, 1, k, 2, 3, 6) [Pa, N/m] per strains in axes (1|e, 3, 3), the section's x axis as above."""
    return section.ply_stiffness(_angles(axis, axes))[:, None]


def initial_stress(section: PlateSection, options: Mapping[str, Any], axes: Array, n: int) -> Array:
    """Initial stress (1|e, 1, n) of plates with these options and axes: prestress less A times the thermal strain.

    Raises ValueError when prestress is not three numbers, or thermal_strain neither one nor three.
    """
    force, strain = force_and_free_strain(options, "a plate")
    angles = _angles(options["axis"], axes)
    stress = np.zeros((len(angles), 1, n))
    stress[:, 0, :3] = np.einsum("eij,i->ej", strain_rotation(angles), force - section.A @ strain)
    return stress


def force_and_free_strain(options: Mapping[str, Any], where: str) -> tuple[Array, Array]:
    """Initial membrane forces (3,) [N/m] and free strain (3,) [1] of the options, xx, yy and xy."""
    force, strain = np.zeros(3), np.zeros(3)
    if options["prestress"] is not None:
        force = np.asarray(options["prestress"], float)
    if options["thermal_strain"] is not None:
        thermal = np.asarray(options["thermal_strain"], float)
        strain = thermal if thermal.ndim else np.array([thermal, thermal, 0.0])
    for name, value in (("prestress", force), ("thermal_strain", strain)):
        if value.shape != (3,) or not np.isfinite(value).all():
            raise ValueError(f"{where} has {name} {options[name]!r}; give three finite numbers, xx, yy and xy")
    return force, strain


def _angles(axis: ArrayLike, axes: Array) -> Array:
    """Angles (1|e,) [rad] of the section's x axis in the axes of elements; one where all are alike."""
    direction = np.asarray(axis, float)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise ValueError(f"axis of a plate is {axis!r}; give a direction of three numbers, not all zero")
    e1, e2, normal = axes.swapaxes(0, 1)
    x = in_plane(direction, normal)
    angles = np.arctan2(np.sum(x * e2, axis=1), np.sum(x * e1, axis=1))
    return angles[:1] if np.abs(angles - angles[0]).max() < ROUNDING else angles
