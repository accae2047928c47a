"""Sets of units of decks, and a check whether the values in a deck are plausible in them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254, "ft": 0.3048}  # [m]
POUND = 0.45359237  # [kg]
STANDARD_GRAVITY = 9.80665  # [m/s^2]
MASSES = {
    "kg": 1.0, "g": 1e-3, "t": 1e3, "lb": POUND, "lbm": POUND,
    "slug": POUND * STANDARD_GRAVITY / 0.3048, "slinch": POUND * STANDARD_GRAVITY / 0.0254,
}  # fmt: skip
FORCES = {"N": 1.0, "kN": 1e3, "lbf": POUND * STANDARD_GRAVITY, "kgf": STANDARD_GRAVITY}  # [N]
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6}  # [s]
COMMON = ("m-kg-s", "mm-t-s", "mm-kg-ms", "mm-g-ms", "cm-g-s", "in-lbf-s", "ft-lbf-s", "in-lb-s")

MODULI = (1e3, 2e12)  # [Pa] Young's moduli of materials, foams and diamond included
DENSITIES = (1.0, 25e3)  # [kg/m^3] of materials, foams and platinum included
EXTENTS = (1e-3, 2e3)  # [m] of a body
USUAL_MODULI, USUAL_DENSITIES, USUAL_EXTENTS = (1e9, 5e11), (500.0, 2e4), (0.05, 100.0)  # of most structures
MASS_RANGE = (1e-6, 1e8)  # [kg] of a body


@dataclass(frozen=True)
class Units:
    """A set of units: what its length, mass and time are in SI.

    name    as declared, such as "mm-t-s"
    length  [m]
    mass    [kg]
    time    [s]
    """

    name: str = "m-kg-s"
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def force(self) -> float:
        """[N]"""
        return self.mass * self.length / self.time**2

    @property
    def moment(self) -> float:
        """[N m]"""
        return self.force * self.length

    @property
    def pressure(self) -> float:
        """[Pa]; moduli too."""
        return self.force / self.length**2

    @property
    def density(self) -> float:
        """[kg/m^3]"""
        return self.mass / self.length**3

    @property
    def inertia(self) -> float:
        """[kg m^2]"""
        return self.mass * self.length**2

    @property
    def spring(self) -> float:
        """[N/m]"""
        return self.force / self.length


def units_of(name: str | Units) -> Units:
    """The set of units with this name, LENGTH-MASS-TIME or LENGTH-FORCE-TIME: "mm-t-s", "in-lbf-s", "m-kg-s",
    "mm-kg-ms".

    "SI" is m-kg-s. If a force is given, the unit of mass is force time^2 / length, such as lbf s^2 / in. Raises
    ValueError with the known units.
    """
    if isinstance(name, Units):
        return name
    if name.upper() == "SI":
        name = "m-kg-s"
    parts = [part.strip() for part in name.replace("_", "-").split("-")]
    if len(parts) == 3 and parts[0] in LENGTHS and parts[2] in TIMES:
        length, time = LENGTHS[parts[0]], TIMES[parts[2]]
        if parts[1] in MASSES:
            return Units(name, length, MASSES[parts[1]], time)
        if parts[1] in FORCES:
            return Units(name, length, FORCES[parts[1]] * time**2 / length, time)
    raise ValueError(
        f"units are {name!r}; give length-mass-time or length-force-time, such as {', '.join(COMMON[:7])}. Lengths are "
        f"{', '.join(LENGTHS)}; masses {', '.join(MASSES)}; forces {', '.join(FORCES)}; times {', '.join(TIMES)}"
    )


def implausible(
    units: Units, moduli: Iterable[float], densities: Iterable[float], extent: float, mass: float
) -> list[str]:
    """Sentences on implausible Young's moduli [Pa], densities [kg/m^3], extent [m] and mass [kg], all in SI, with the
    common sets of units in which the values would be plausible."""
    E, rho = list(moduli), list(densities)
    outliers = _outliers(E, rho, extent, mass)
    plausible_units = []
    for name in COMMON if outliers and (E or rho) else ():
        other = units_of(name)
        values = [value / units.pressure * other.pressure for value in E]
        densities_in_other = [value / units.density * other.density for value in rho]
        if name != units.name and not _outliers(values, densities_in_other, extent / units.length * other.length):
            plausible_units.append(name)
    hint = f" In {' or '.join(plausible_units)} its materials and its size are usual." if plausible_units else ""
    text = f"read in {units.name} it has {' and '.join(outliers)}; check the declared units.{hint}"
    return [text] if outliers else []


def _outliers(moduli: list[float], densities: list[float], extent: float, mass: float = 0.0) -> list[str]:
    """Words on the value of each quantity that lies farthest from the usual ones, in SI; zero is passed over."""
    words = []
    for quantity, values, (low, high), unit in (
        ("a Young's modulus", moduli, MODULI, "Pa"),
        ("a density", densities, DENSITIES, "kg/m^3"),
        ("an extent", [extent], EXTENTS, "m"),
        ("a mass", [mass], MASS_RANGE, "kg"),
    ):
        worst = max(values, key=lambda value: _decades_outside(value, low, high), default=0.0)
        if _decades_outside(worst, low, high):
            words.append(f"{quantity} of {worst:.4g} {unit} (usual are {low:.4g} to {high:.4g})")
    return words


def likely_units(moduli: Iterable[float], densities: Iterable[float], extent: float) -> tuple[str, str]:
    """The most plausible common set of units for Young's moduli, densities and extent as written in a deck, and the
    reason."""
    E, rho = sorted(value for value in moduli if value > 0), sorted(value for value in densities if value > 0)
    if not E:
        return COMMON[0], "assumed: the deck has no Young's modulus to judge by"
    e, r = E[len(E) // 2], rho[len(rho) // 2] if rho else None

    def distance(name: str) -> float:
        u = units_of(name)
        decades = [_decades_outside(e * u.pressure, *USUAL_MODULI)] + (
            [_decades_outside(r * u.density, *USUAL_DENSITIES)] if r else []
        )
        return sum(decades) + 0.5 * _decades_outside(extent * u.length, *USUAL_EXTENTS)

    best = min(COMMON, key=distance)
    u = units_of(best)
    density_text = f", a density of {r * u.density:.4g} kg/m^3" if r else ""
    reason = (
        f"a guess: in these E is {e * u.pressure / 1e9:.4g} GPa{density_text}, and it spans {extent * u.length:.4g} m"
    )
    return best, reason


def _decades_outside(value: float, low: float, high: float) -> float:
    """Decades by which a positive value lies outside a range."""
    return max(math.log10(low / value), math.log10(value / high), 0.0) if value > 0 else 0.0
