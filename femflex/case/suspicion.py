"""Numbers that are possible but look like another unit: warned of, with both readings."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from femflex.case.case import Case
from femflex.case.problems import item_label
from femflex.warning import PhysicsWarning

FAST = 20.0  # rad/s: three turns a second, more than craft and their appendages do
ROTOR = 1500.0  # rad/s, 14,300 rpm: more than reaction wheels do
FULL_TURN = 2.0 * math.pi
ROTOR_KEYS = ("speed", "initial_speed", "max_speed")  # of wheels
RATE_KEYS, ANGLE_KEYS = (
    ("rate", "rates", "spin", "max_rate", *ROTOR_KEYS),
    (
        "angle",
        "angles",
        "initial_angles",
        "pitch",
        "yaw",
        "roll",
        "rest",
    ),
)
ATTITUDE_KEYS = ("angle", "angles", "pitch", "yaw", "roll")  # in which something starts: within half a turn
ORBIT_ANGLES = ("inclination", "node", "perigee", "true_anomaly")


def warn_of_doubtful_numbers(raw: Mapping[str, Any], case: Case) -> None:
    """Warn of rates and angles in plain numbers (or rad/s) that look like degrees.

    Bare angles in which bodies and joints start are warned of beyond half a turn, as all attitudes lie within; others,
    and those that say "rad", beyond a whole one.
    """
    for where, table, keys in _tables(raw):
        for key in keys:
            for number in _plain_numbers(table.get(key), "rad"):
                rate = key in RATE_KEYS
                half = key in ATTITUDE_KEYS and "rad" not in str(table[key])
                most = ROTOR if key in ROTOR_KEYS else FAST if rate else (math.pi if half else FULL_TURN) * (1 + 1e-9)
                if abs(number) > most:
                    warnings.warn(_doubtful(f"{where}.{key}", number, "/s" if rate else ""), stacklevel=4)
                    break


def _doubtful(where: str, number: float, per: str) -> PhysicsWarning:
    rotor = where.endswith(ROTOR_KEYS)
    units, unit = ("revolutions per minute", "rpm") if rotor else ("degrees", f"deg{per}")
    return PhysicsWarning(
        "{body_or_joint}: {value:g} is read as {value:g} rad{per} ({turns:.3g} turns{of_time});",
        body_or_joint=where,
        value=number,
        remedy=f'if {units} were meant, write "{{value:g}} {unit}" ({{radians:.4g}} rad{{per}})',
        per=per,
        turns=number / FULL_TURN,
        of_time=" a second" if per else "",
        radians=number * FULL_TURN / 60.0 if rotor else math.radians(number),
    )


def _tables(raw: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any], tuple[str, ...]]]:
    yield "attitude", raw.get("attitude", {}), RATE_KEYS + ANGLE_KEYS
    yield "orbit", raw.get("orbit", {}), ORBIT_ANGLES
    for name, wheel in raw.get("wheels", {}).items():
        yield f"wheels.{name}", wheel, ROTOR_KEYS
    for name, gyro in raw.get("gyros", {}).items():
        yield f"gyros.{name}", gyro, ("rates", "angles", "initial_angles", "max_rate")
    for name, sensor in raw.get("sensors", {}).items():
        if isinstance(reference := sensor.get("reference"), dict):
            yield f"sensors.{name}.reference", reference, ATTITUDE_KEYS
    joints = raw.get("joints", [])
    for k, joint in enumerate(joints):
        turning = joint.get("kind") not in ("prismatic", "weld")
        yield f"joints[{item_label(joints, k)}]", joint, RATE_KEYS + ANGLE_KEYS if turning else ()


def _plain_numbers(value: Any, unit: str) -> Iterator[float]:
    """Numbers without a unit, or with radians written out, in a value and its entries."""
    if isinstance(value, list):
        for entry in value:
            yield from _plain_numbers(entry, unit)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield float(value)
    elif isinstance(value, str) and value.split()[-1:] in (["rad/s"], [unit]):
        yield float(value.split()[0])
