"""Strain blocks of members that have no stiffness across themselves but that of their tension."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.fem.tables import DenseStrain

Array = NDArray[np.float64]

PRINCIPAL = {1: "tension", 3: "lowest principal stress resultant"}  # by number of strains
UNITS = {1: "N", 3: "N/m"}


@dataclass(frozen=True, eq=False)
class TensionStrain(DenseStrain):
    """A strain block of a tether, eps (s = 1), or of a membrane, eps_xx, eps_yy, gamma_xy (s = 3).

    group, family  of its member
    places (e, q, 3)  of its points, undeformed [m]
    viscosity         internal (Kelvin-Voigt) damping: stress C viscosity d eps/dt beside C eps [s]
    """

    group: str = ""
    family: str = ""
    places: Array | None = None
    viscosity: float = 0.0

    def lowest_tension(self) -> Array:
        """Tension [N] or lowest principal stress resultant [N/m] of the initial stress at the points (e, q)."""
        return lowest_principal(np.broadcast_to(self.stress, (*self.weight.shape, self.stress.shape[-1])))


def lowest_principal(stress: Array) -> Array:
    """Lowest principal value (...) of stresses (..., 1) of a line or (..., 3) of a sheet."""
    if stress.shape[-1] == 1:
        return np.asarray(stress[..., 0])
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    return np.asarray((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy))
