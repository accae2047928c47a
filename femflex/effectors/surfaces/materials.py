"""Optical and thermal properties of surfaces, and a catalogue of usual ones."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pydantic import model_validator

from femflex.noun.table import Table, refuse
from femflex.noun.values import Quantity

Share = Annotated[float, Quantity(least=0.0, most=1.0)]


class Optical(Table):
    """Properties of one side of a surface. What light is not reflected is absorbed."""

    specular: Share = 0.0
    """Share of the light that is reflected as by a mirror."""
    diffuse: Share = 0.0
    """Share that is reflected in all directions, by the cosine of the angle to the normal."""
    emissivity: Share = 0.0
    """Emissivity of heat radiation."""

    @model_validator(mode="after")
    def _shares_of_light(self) -> Optical:
        if self.specular + self.diffuse > 1.0 + 1e-12:
            refuse(
                f"found specular {self.specular:g} and diffuse {self.diffuse:g}, together "
                f"{self.specular + self.diffuse:g}; with the absorbed share they are 1, so give at most 1"
            )
        return self


class SideProperties(NamedTuple):
    """Shares of light and emissivity of a usual surface."""

    specular: float
    diffuse: float
    emissivity: float


# Absorptivity and emissivity at the beginning of life after D. G. Gilmore (ed.), Spacecraft Thermal Control Handbook
# (2nd ed., 2002), appendix A, rounded; specular and diffuse shares of what is reflected by the kind of the surface. The
# sail is the ideal film of C. R. McInnes, Solar Sailing (1999), table 2.1: reflectivity 0.88, 94 % of it specular.
CATALOGUE = {
    "black": SideProperties(0.0, 0.0, 1.0),
    "mirror": SideProperties(1.0, 0.0, 0.0),
    "solar_cell": SideProperties(0.21, 0.0, 0.81),
    "carbon_back": SideProperties(0.0, 0.10, 0.85),
    "white_paint": SideProperties(0.0, 0.80, 0.90),
    "black_paint": SideProperties(0.0, 0.04, 0.88),
    "gold_mli": SideProperties(0.40, 0.25, 0.60),
    "black_mli": SideProperties(0.05, 0.05, 0.80),
    "aluminised_film": SideProperties(0.83, 0.05, 0.05),
    "sail_front": SideProperties(0.8272, 0.0528, 0.05),
    "sail_back": SideProperties(0.0, 0.45, 0.55),
    "radiator_mirror": SideProperties(0.90, 0.02, 0.80),
    "bare_aluminium": SideProperties(0.70, 0.15, 0.05),
}
