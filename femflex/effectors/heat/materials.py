"""Thermal properties of usual materials."""

from __future__ import annotations

from typing import NamedTuple


class ThermalProperties(NamedTuple):
    """Density [kg/m^3], specific heat [J/kg K], conductivity [W/m K] and expansion [1/K] at room temperature."""

    density: float
    specific_heat: float
    conductivity: float
    expansion: float


# Metals after ASM International, Metals Handbook, vol. 1 and 2 (10th ed., 1990), rounded; the polyimide after DuPont's
# data sheet of Kapton HN.
CATALOGUE = {
    "aluminium_6061": ThermalProperties(2700.0, 896.0, 167.0, 23.6e-6),
    "aluminium_7075": ThermalProperties(2810.0, 960.0, 130.0, 23.6e-6),
    "titanium_6al4v": ThermalProperties(4430.0, 526.0, 6.7, 8.6e-6),
    "stainless_304": ThermalProperties(8000.0, 500.0, 16.2, 17.3e-6),
    "copper_beryllium": ThermalProperties(8250.0, 420.0, 115.0, 17.8e-6),
    "invar_36": ThermalProperties(8050.0, 515.0, 10.5, 1.6e-6),
    "polyimide": ThermalProperties(1420.0, 1090.0, 0.12, 20.0e-6),
}
