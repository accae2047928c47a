"""Possible numbers that look like another unit: warnings with both readings."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from femflex.case.case import Case
from femflex.effectors.registry import nouns
from femflex.noun.problems import item_label
from femflex.warning import PhysicsWarning

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
