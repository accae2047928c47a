"""Elastic materials."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """An isotropic linear elastic material.

    E        Young's modulus [N/m^2]
    nu       Poisson's ratio
    density  [kg/m^3]
    G        shear modulus [N/m^2]; left out, that of an isotropic material, E / 2(1 + nu)
    """

    E: float
    nu: float
    density: float
    G: float = math.nan

    def __post_init__(self) -> None:
        if not self.E > 0 or math.isinf(self.E):
            raise ValueError(f"Young's modulus E is {self.E} N/m^2; it must be positive and finite")
        if not -1.0 < self.nu < 0.5:
            raise ValueError(f"Poisson's ratio nu is {self.nu}; an isotropic material has -1 < nu < 0.5")
        if not self.density >= 0 or math.isinf(self.density):
            raise ValueError(f"density is {self.density} kg/m^3; it must be finite and cannot be negative")
        if math.isnan(self.G):
            object.__setattr__(self, "G", self.E / (2.0 * (1.0 + self.nu)))
        if not self.G > 0 or math.isinf(self.G):
            raise ValueError(f"shear modulus G is {self.G} N/m^2; it must be positive and finite")
