"""Elastic matrices of plate sections in the axes of elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.fem.option import Option, Options
from femflex.fem.plate.frames import ROUNDING, section_angles
from femflex.fem.sections.laminates import PlateSection, strain_rotation

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
    """`PlateSection.plies` (1|e, 1, k, 2, 3, 6) per strains in axes (1|e, 3, 3), the section's x axis as above."""
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
    angles = section_angles(direction, axes)
    return angles[:1] if np.abs(angles - angles[0]).max() < ROUNDING else angles
