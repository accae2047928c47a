"""Elastic matrices of plate sections in the axes of elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femflex.fem.laminates import PlateSection
from femflex.fem.plate_frames import DUST, section_angles

Array = NDArray[np.float64]


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
    """Stiffness of the section in axes (1|e, 3, 3) when its x axis is `axis` (3,), global, laid into the planes.

    Raises ValueError when axis is not a direction.
    """
    direction = np.asarray(axis, float)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise ValueError(f"axis of a plate is {axis!r}; give a direction of three numbers, not all zero")
    angles = section_angles(direction, axes)
    if np.abs(angles - angles[0]).max() < DUST:
        angles = angles[:1]
    return Stiffness(*section.stiffness(angles))
