"""The same craft written otherwise: with other names, its tables from last to first, its values in other units."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from femflex.case.changed import toml_text

NAMED = (
    "bodies", "joints", "loops", "springs", "constraints", "loads", "signals", "sensors", "controllers", "wheels",
    "gyros", "thrusters", "tanks", "separations", "cables", "sights", "materials", "sections",
)  # fmt: skip
UNORDERED = {"name", "family", "mass", "translation"}  # keys of tables whose order in a list means nothing
OF_BODIES = ("markers", "recovery", "regions")
ALIKE = ("w", "w1", "w11", "w_", "w_1", "w_1_1", "ww")  # each begins another, or differs from it by its end alone

# unit: another one of the same kind, how many of it make one
OTHER_UNITS = {
    "m": ("mm", 1e3), "mm": ("m", 1e-3), "kg": ("g", 1e3), "g": ("kg", 1e-3), "s": ("ms", 1e3), "ms": ("s", 1e-3),
    "N": ("mN", 1e3), "kN": ("N", 1e3), "N m": ("N mm", 1e3), "GPa": ("MPa", 1e3), "MPa": ("Pa", 1e6),
    "deg": ("arcmin", 60.0), "deg/s": ("deg/min", 60.0), "kg m^2": ("kg mm^2", 1e6), "kg/m^3": ("g/cm^3", 1e-3),
    "N/m": ("N/mm", 1e-3), "N s/m": ("N ms/m", 1e3), "N m/rad": ("N mm/rad", 1e3), "N m s/rad": ("N mm s/rad", 1e3),
    "m/s": ("mm/s", 1e3), "m/s^2": ("mm/s^2", 1e3), "N m s": ("N mm s", 1e3), "kg/m": ("g/m", 1e3),
    "kg/m^2": ("g/m^2", 1e3), "km": ("m", 1e3), "kPa": ("Pa", 1e3), "Pa": ("kPa", 1e-3), "%": ("1", 1e-2),
    "N m^2": ("N mm^2", 1e6), "h": ("min", 60.0), "1/s": ("1/ms", 1e-3), "Hz": ("mHz", 1e3),
    "mm/s": ("m/s", 1e-3), "kN/m": ("N/mm", 1.0), "g/m": ("kg/m", 1e-3), "g/m^2": ("kg/m^2", 1e-3),
    "mm^2": ("cm^2", 1e-2), "mm^4": ("cm^4", 1e-4),
}  # fmt: skip
QUANTITY = re.compile(r"([-+]?[\d.]+(?:e[-+]?\d+)?) (.+)")


def names_of(text: str) -> list[str]:
    """Names that a case gives to its things, to what its bodies have and to laws of joints, in alphabetical order."""
    tables = tomllib.loads(text)
    found = set()
    for key in NAMED:
        part = tables.get(key, {})
        found |= set(part) if isinstance(part, Mapping) else {one["name"] for one in part if "name" in one}
    for joint in tables.get("joints", []):
        found |= {law["name"] for law in joint.get("laws", []) if "name" in law}
    for body in tables.get("bodies", {}).values():
        found |= set().union(*(body.get(key, {}) for key in OF_BODIES))
    return sorted(found)


def similar_names(names: list[str]) -> dict[str, str]:
    """Another name for each of these, in the same alphabetical order, which begins as its neighbours do."""
    made = sorted(f"{first}{second}" for first in ALIKE for second in ("", *(f"_{one}" for one in ALIKE), *ALIKE[1:3]))
    others = sorted(set(made))[: len(names)]
    assert len(others) == len(names), "more names than are known that are alike"
    return dict(zip(names, others, strict=True))


def renamed(text: str, names: Mapping[str, str]) -> str:
    """A text with every one of these words replaced, and the names that sampled sensors and reels make of theirs."""
    words = "|".join(sorted(map(re.escape, names), key=len, reverse=True))
    return re.sub(rf"(?<!\w)({words})(?=_exact\b|_reel\b|\W|$)", lambda found: names[found[1]], text)


def reordered(text: str) -> str:
    """A case with its tables from last to first, and in each of them its keys."""
    return toml_text(_reversed_order(tomllib.loads(text)))


def _reversed_order(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _reversed_order(part) for key, part in reversed(value.items())}
    if isinstance(value, list) and any(isinstance(part, dict) and set(part) & UNORDERED for part in value):
        return [_reversed_order(part) for part in reversed(value)]
    return [_reversed_order(part) for part in value] if isinstance(value, list) else value


def in_other_units(text: str) -> str:
    """A case whose values have other units."""
    tables = tomllib.loads(text)
    for holder, key, number, unit in list(_quantities(tables)):
        other, many = OTHER_UNITS[unit]
        holder[key] = f"{number * many:.15g} {other}"
    return toml_text(tables)


def _quantities(value: Any) -> Iterator[tuple[Any, Any, float, str]]:
    parts = value.items() if isinstance(value, dict) else enumerate(value)
    for key, part in list(parts):
        if isinstance(part, (dict, list)):
            yield from _quantities(part)
        elif isinstance(part, str) and (found := QUANTITY.fullmatch(part)) and found[2] in OTHER_UNITS:
            yield value, key, float(found[1]), found[2]
