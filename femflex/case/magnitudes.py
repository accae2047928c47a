"""Magnitudes that no material, orbit or section has, but the same number in another unit would: both readings shown."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

from femflex.case.body import AnalyticTable, FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.matrices import MatricesTable
from femflex.fem.sections.laminates import Lamina
from femflex.fem.sections.materials import Material
from femflex.fem.sections.named import CoreMaterial, LayupTable, SandwichTable
from femflex.warning import PhysicsWarning

LOWEST = 80e3  # m; drag ends an orbit below within a revolution
DENSITIES = 1.0, 2.5e4  # kg/m^3: aerogel, osmium
MODULI = 1e5, 1.5e12  # Pa: soft foam, diamond
STRUCTURAL = 5e8, 1.5e12  # Pa; what is built with, and a mistaken unit is taken to mean
DAMPED = 0.2  # of critical; structures have a hundredth of that
GYRATION = 300.0  # m; radius of gyration beyond that of any craft


def warn_of_doubtful_magnitudes(case: Case) -> None:
    """Warn of every magnitude in a case that is more likely another unit's, and say which."""
    for text in (*_orbit(case), *_materials(case), *_sections(case), *_bodies(case)):
        warnings.warn(text, PhysicsWarning, stacklevel=4)


def _orbit(case: Case) -> Iterator[str]:
    altitude = case.orbit.perigee_altitude
    if altitude is not None and altitude < LOWEST:
        kilometres = LOWEST <= 1e3 * altitude
        hint = (
            f'; if kilometres were meant, write "{altitude:g} km"'
            if kilometres
            else "; drag ends an orbit there within a revolution"
        )
        yield f"orbit.perigee_altitude: found {altitude:g} m, below {LOWEST / 1e3:g} km{hint}"


def _materials(case: Case) -> Iterator[str]:
    for name, material in case.materials.items():
        density = material.density
        if density and not DENSITIES[0] <= density <= DENSITIES[1]:
            grams = 1e3 * density
            hint = f'; if g/cm^3 were meant, write "{density:g} g/cm^3" ({grams:g} kg/m^3)'
            fits = DENSITIES[0] <= grams <= DENSITIES[1]
            yield (
                f"materials.{name}.density: found {density:g} kg/m^3; materials have {DENSITIES[0]:g} to "
                f"{DENSITIES[1]:g} kg/m^3{hint if fits else ''}"
            )
        elif 1.0 <= density <= 25.0 and not isinstance(material, CoreMaterial) and material.density != 0.0:
            yield (
                f"materials.{name}.density: found {density:g} kg/m^3, that of a foam; if g/cm^3 were meant, write "
                f'"{density:g} g/cm^3" ({1e3 * density:g} kg/m^3)'
            )
        keys = {
            Material: ("E", "G"),
            Lamina: ("E1", "E2", "G12", "G13", "G23"),
            CoreMaterial: ("G13", "G23"),
        }
        for key in keys[type(material)]:
            value = getattr(material, key)
            if key in material.model_fields_set and value is not None and not MODULI[0] <= value <= MODULI[1]:
                yield (
                    f"materials.{name}.{key}: found {value:g} Pa; materials have {MODULI[0]:g} to {MODULI[1]:g} Pa"
                    + (_in_units(value))
                )


def _in_units(value: float) -> str:
    for unit, factor in (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)):
        if STRUCTURAL[0] <= value * factor <= STRUCTURAL[1]:
            return f'; if {unit} were meant, write "{value:g} {unit}"'
    return ""


def _sections(case: Case) -> Iterator[str]:
    for name, section in case.sections.items():
        if isinstance(section, SandwichTable) and section.face.thickness > section.core.thickness:
            face, core = section.face.thickness, section.core.thickness
            yield (
                f"sections.{name}.face.thickness: found faces of {face:g} m on a core of {core:g} m; if millimetres "
                f'were meant, write "{face:g} mm" ({face / 1e3:g} m)'
            )
        if isinstance(section, LayupTable) and max(ply.thickness for ply in section.plies) > 0.1:
            ply = max(ply.thickness for ply in section.plies)
            yield f'sections.{name}.plies: found a ply of {ply:g} m; if millimetres were meant, write "{ply:g} mm"'


def _bodies(case: Case) -> Iterator[str]:
    for name, body in case.bodies.items():
        elastic = FlexibleTable | AnalyticTable | FileTable | MatricesTable
        damping = getattr(body, "damping", None) if isinstance(body, elastic) else None
        ratios = () if damping is None or damping.ratio is None else damping.ratio
        largest = max(ratios, default=0.0) if isinstance(ratios, tuple) else ratios
        if largest > DAMPED:
            yield (
                f"bodies.{name}.damping.ratio: found {largest:g}, which is {largest:.0%} of critical damping; if "
                f'percent were meant, write "{largest:g} %"'
            )
        if isinstance(body, RigidTable):
            radius = (max(body.inertia[k][k] for k in range(3)) / body.mass) ** 0.5
            if radius > GYRATION:
                yield (
                    f"bodies.{name}.inertia: with {body.mass:g} kg it makes a radius of gyration of {radius:.4g} m, "
                    f"beyond {GYRATION:g} m; if kg mm^2 or tonnes were meant, write the unit"
                )
