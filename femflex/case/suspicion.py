"""Numbers that look like another unit, and magnitudes beyond the usual: warnings with both readings."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from femflex.case.body import AnalyticTable, FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.matrices import MatricesTable
from femflex.effectors.registry import nouns
from femflex.fem.sections.laminates import Lamina
from femflex.fem.sections.materials import Material
from femflex.fem.sections.named import CoreMaterial, LayupTable, SandwichTable
from femflex.noun.problems import item_label
from femflex.warning import PhysicsWarning, warn_of_physics

FAST = 20.0  # rad/s: three turns a second, more than craft and their appendages do
FASTEST_WHEEL = 1000.0  # rad/s, 9550 rpm: more than reaction and momentum wheels do
FULL_TURN = 2.0 * math.pi
ATTITUDES = ("angle", "angles", "pitch", "yaw", "roll")  # initial or constant angles: within half a turn
TURNS = ("rest", "initial_angles", "misalignment", "inclination", "node", "perigee", "true_anomaly")
RATES, SPEEDS = ("rate", "rates", "spin"), ("speed", "initial_speed")
OF_MOTIONS = ("from", "to", "value", "values", "amplitude", "mean")  # of an angle over time
CHECKED_TABLES = (
    "attitude",
    "orbit",
    "sections",
    "bodies",
    "joints",
    "loops",
)
LENGTHS = ("reel", "initial", "laws", "dynamics")  # tables whose keys of these names are no angles


def warn_of_doubtful_numbers(raw: Mapping[str, Any], case: Case) -> None:
    """Warn of rates and angles in plain numbers (or rad/s) that look like degrees, and of wheel speeds like rpm.

    Initial angles of bodies and joints without a unit are reported beyond half a turn, because all attitudes are within
    it. Others, and angles written in "rad", are reported beyond a whole turn.
    """
    for key in (*CHECKED_TABLES, *nouns()):
        for key_path, name, value in _numbers_of_tables(key, raw.get(key, {})):
            rate, speed = name in RATES, key == "wheels" and name in SPEEDS
            half = name in ATTITUDES and "rad" not in str(value)
            turn = rate or half or name in (*ATTITUDES, *TURNS) or (".motion." in key_path and name in OF_MOTIONS)
            if not (turn or speed):
                continue
            limit = FASTEST_WHEEL if speed else FAST if rate else (math.pi if half else FULL_TURN) * (1 + 1e-9)
            number = max(_plain_numbers(value, "rad"), key=abs, default=0.0)
            if abs(number) > limit:
                warnings.warn(
                    _unit_warning(f"{key_path}.{name}", number, "/s" if rate or speed else "", speed), stacklevel=4
                )


def _unit_warning(key_path: str, number: float, per: str, speed: bool) -> PhysicsWarning:
    noun = "rpm was" if speed else "degrees were"
    unit, factor = ("rpm", FULL_TURN / 60.0) if speed else (f"deg{per}", FULL_TURN / 360.0)
    return PhysicsWarning(
        "{body_or_joint}: {value:g} is read as {value:g} rad{per} ({turns:.3g} turns{of_time});",
        body_or_joint=key_path,
        value=number,
        remedy=f'if {noun} meant, write "{{value:g}} {unit}" ({{radians:.4g}} rad{per})',
        per=per,
        turns=number / FULL_TURN,
        of_time=" a second" if per else "",
        radians=number * factor,
    )


def _numbers_of_tables(key_path: str, table: Any) -> Iterator[tuple[str, str, Any]]:
    """Key path, key and value of everything in a table and its tables, except slides."""
    if isinstance(table, list):
        for k, entry in enumerate(table):
            if isinstance(entry, dict):
                yield from _numbers_of_tables(f"{key_path}[{item_label(table, k)}]", entry)
    elif isinstance(table, dict) and table.get("kind") not in ("prismatic", "weld"):
        for key, value in table.items():
            if not isinstance(value, dict | list):
                yield key_path, key, value
            elif isinstance(value, list) and not any(isinstance(entry, dict) for entry in value):
                yield key_path, key, value
            elif key not in LENGTHS and not (key_path.endswith(".motion") and key.startswith("position")):
                yield from _numbers_of_tables(f"{key_path}.{key}", value)


def _plain_numbers(value: Any, unit: str) -> Iterator[float]:
    """Numbers without a unit, or with radians written out, in a value and its entries."""
    if isinstance(value, list):
        for entry in value:
            yield from _plain_numbers(entry, unit)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield float(value)
    elif isinstance(value, str) and value.split()[-1:] in (["rad/s"], [unit]):
        yield float(value.split()[0])


LOWEST = 80e3  # m; drag ends an orbit below within a revolution
DENSITIES = 1.0, 2.5e4  # kg/m^3: aerogel, osmium
MODULI = 1e5, 1.5e12  # Pa: soft foam, diamond
STRUCTURAL = 5e8, 1.5e12  # Pa; what is built with, and a mistaken unit is taken to mean
DAMPED = 0.2  # of critical; structures have a hundredth of that
GYRATION = 300.0  # m; radius of gyration beyond that of any craft


def warn_of_doubtful_magnitudes(case: Case) -> None:
    """Warn of every magnitude in a case that is more likely another unit's, and say which."""
    for text in (*_orbit(case), *_materials(case), *_sections(case), *_bodies(case)):
        warn_of_physics(text)


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
