"""Motions that a case specifies for joint coordinates: "locked", a number, or a profile over time.

motion.angle = "locked"                                            # stays at its initial value
motion.angle = "30 deg"                                            # stays there
motion.angle = { kind = "smooth_step", from = 0, to = "30 deg", start = 0, end = "5 s" }
motion.angle = { kind = "sine", amplitude = "2 deg", frequency = "0.1 Hz", phase = 0, mean = 0 }
motion.angle = { kind = "polynomial", coefficients = [0, "1 deg/s"] }
motion.angle = { kind = "trapezoid", from = 0, to = "30 deg", start = 0, end = "5 s", ramp = "1 s" }
motion.angle = { kind = "table", times = [0, 1, 2, 3], values = [0, 0.1, 0.3, 0.4], degree = 3, ends = "rest" }
motion.angle = { kind = "table", file = "track.csv", column = "azimuth" }
motion.position = { kind = "record", file = "earthquake.csv", column = "north" }    # of the acceleration
motion.angle = { kind = "sum", parts = [ {...}, {...} ] }
motion.angles = ["locked", "free", {...}]                          # where a joint has several
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from femflex.noun.problems import suggestion_text
from femflex.noun.units import NOUNS, UnitError
from femflex.noun.values import Quantity, ValueProblem, _Readable, checked_word, value_text
from femflex.system.columns import column_of
from femflex.system.profile import ENDS, Profile
from femflex.system.record import BASELINES, read_record, record

FREE, LOCKED = "free", "locked"
KEYS = {
    "constant": ("value",),
    "polynomial": ("coefficients",),
    "sine": ("amplitude", "frequency", "phase", "mean"),
    "smooth_step": ("from", "to", "start", "end"),
    "trapezoid": ("from", "to", "start", "end", "ramp"),
    "table": ("times", "values", "file", "column", "degree", "ends"),
    "record": ("file", "column", "baseline", "factor", "start"),
    "sum": ("parts",),
}
NEEDED = {
    "constant": ("value",),
    "polynomial": ("coefficients",),
    "sine": ("amplitude", "frequency"),
    "smooth_step": ("to", "start", "end"),
    "trapezoid": ("to", "start", "end", "ramp"),
    "record": ("file",),
    "sum": ("parts",),
}
MEANINGS = {
    "constant": {"kind": "Selects this motion: a constant value.", "value": "Value of the coordinate [m or rad]."},
    "polynomial": {
        "kind": "Selects this motion: a polynomial in time.",
        "coefficients": "Coefficients, the constant first [m or rad, per power of second].",
    },
    "sine": {
        "kind": "Selects this motion: mean + amplitude sin(2 pi frequency t + phase).",
        "amplitude": "Amplitude [m or rad].",
        "frequency": "Frequency [Hz].",
        "phase": "Phase at t = 0 [rad]. Default: 0.",
        "mean": "Mean value [m or rad]. Default: 0.",
    },
    "smooth_step": {
        "kind": "Selects this motion: a step with continuous jerk.",
        "from": "Value before the step [m or rad]. Default: 0.",
        "to": "Value after the step [m or rad].",
        "start": "Time at which the step begins [s].",
        "end": "Time at which the step ends [s].",
    },
    "trapezoid": {
        "kind": "Selects this motion: a rate that rises linearly, stays and falls linearly.",
        "from": "Value before the motion [m or rad]. Default: 0.",
        "to": "Value after the motion [m or rad].",
        "start": "Time at which the motion begins [s].",
        "end": "Time at which the motion ends [s].",
        "ramp": "Duration of the rise of the rate, and of its fall [s].",
    },
    "table": {
        "kind": "Selects this motion: a spline through a table.",
        "times": "Times of the points, rising [s].",
        "values": "Values at these times [m or rad].",
        "file": "CSV file, relative to the case file, in place of times and values.",
        "column": "Column of the CSV file; its head states the unit, as in 'azimuth [deg]'.",
        "degree": "Degree of the spline, 3 or 5. Default: 3.",
        "ends": "End condition of the spline: 'not_a_knot' or 'rest'. Default: not_a_knot.",
    },
    "record": {
        "kind": "Selects this motion: that with a recorded acceleration, from rest at zero.",
        "file": "CSV file, or record of PEER (.AT2, in g), relative to the case file.",
        "column": "Column of accelerations of a CSV file; its head states the unit, as in 'north [g0]'.",
        "baseline": "'rest': a constant and a slope are taken from the acceleration so that the motion ends at rest "
        "where it began; 'least': a parabola, with which the mean square of the rate is least; 'none'. Default: rest.",
        "factor": "Factor on the acceleration. Default: 1.",
        "start": "Time at which the record begins [s]. Default: that of its first row.",
    },
    "sum": {"kind": "Selects this motion: a sum of motions.", "parts": "The motions that are added, at least two."},
}


@dataclass(frozen=True)
class Motion:
    """A motion as in a case: locked at the initial value, or `profile(folder)`.

    folder  that contains the case file; a motion from a file raises ValueError when it cannot be read
    files   that contain its tables
    table   of the case that describes it
    """

    locked: bool = False
    profile: Callable[[Path], Profile] | None = None
    files: tuple[str, ...] = ()
    table: Any = None


class MotionOf(_Readable):
    """A motion of a coordinate with that unit ("m", "rad")."""

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def read_value(self, value: Any) -> Motion | None:
        """The motion; None if free."""
        if isinstance(value, Profile):
            return self._fixed(value)
        if value == FREE:
            return None
        if value == LOCKED:
            return Motion(locked=True)
        if isinstance(value, Mapping):
            return replace(self._motion_of_kind(dict(value)), table=dict(value))
        if isinstance(value, str) and not re.match(r"\s*[-+.\d]", value):
            raise ValueProblem(
                f"found {value_text(value)}; a motion is 'locked', 'free', a number, or a table such as "
                '{kind = "smooth_step", from = 0, to = 1, start = 0, end = 5}'
            )
        return self._fixed(Profile.constant(Quantity(self.unit).read_value(value)))

    def _motion_of_kind(self, table: dict[str, Any]) -> Motion:
        kind = checked_word(table.pop("kind", None), KEYS, "kind", " of a motion")
        for key in table:
            if key not in KEYS[kind]:
                raise ValueProblem(
                    f"found key {key!r} in a motion of kind {kind!r}; {suggestion_text(key, KEYS[kind])}"
                )
        missing = [key for key in NEEDED.get(kind, ()) if key not in table]
        if missing:
            raise ValueProblem(f"key {missing[0]!r} is missing in a motion of kind {kind!r}")
        try:
            motion: Motion = getattr(self, f"_{kind}")(table)
            return motion
        except (ValueProblem, UnitError):
            raise
        except ValueError as error:
            raise ValueProblem(str(error)) from None

    @staticmethod
    def _fixed(profile: Profile) -> Motion:
        return Motion(profile=lambda folder: profile)

    def _value(self, table: dict[str, Any], key: str, unit: str | None = None, default: float = 0.0) -> float:
        if key not in table:
            return default
        try:
            return float(Quantity(self.unit if unit is None else unit).read_value(table[key]))
        except (ValueProblem, UnitError) as problem:
            raise ValueProblem(f"{key}: {problem}") from None

    def _constant(self, table: dict[str, Any]) -> Motion:
        return self._fixed(Profile.constant(self._value(table, "value")))

    def _polynomial(self, table: dict[str, Any]) -> Motion:
        rows = table["coefficients"]
        if not isinstance(rows, list) or not rows:
            raise ValueProblem(f"coefficients: found {value_text(rows)}; expected a list, the constant first")
        units = [self.unit, f"{self.unit}/s", *(f"{self.unit}/s^{k}" for k in range(2, len(rows)))]
        return self._fixed(
            Profile.polynomial(*(_coefficient(row, unit) for row, unit in zip(rows, units, strict=False)))
        )

    def _sine(self, table: dict[str, Any]) -> Motion:
        amplitude, mean = self._value(table, "amplitude"), self._value(table, "mean")
        omega = 2 * math.pi * self._value(table, "frequency", "Hz")
        return self._fixed(Profile.sine(amplitude, omega, self._value(table, "phase", "rad"), mean))

    def _smooth_step(self, table: dict[str, Any]) -> Motion:
        start, end = self._value(table, "start", "s"), self._value(table, "end", "s")
        return self._fixed(Profile.smooth_step(start, end, self._value(table, "from"), self._value(table, "to")))

    def _trapezoid(self, table: dict[str, Any]) -> Motion:
        start, end, ramp = (self._value(table, key, "s") for key in ("start", "end", "ramp"))
        start_value, end_value = self._value(table, "from"), self._value(table, "to")
        return self._fixed(Profile.trapezoid(start, end, start_value, end_value, ramp))

    def _table(self, table: dict[str, Any]) -> Motion:
        degree, ends = table.get("degree", 3), table.get("ends", "not_a_knot")
        if isinstance(degree, bool) or degree not in (3, 5) or not isinstance(ends, str) or ends not in ENDS:
            raise ValueProblem(
                f"found degree {value_text(degree)} and ends {value_text(ends)}; known are 3 and 5, "
                f"{' and '.join(ENDS)}"
            )
        inline, filed = ("times" in table, "values" in table), ("file" in table, "column" in table)
        if all(inline) and not any(filed):
            times, values = (
                Quantity(unit, (None,)).read_value(table[key]) for key, unit in (("times", "s"), ("values", self.unit))
            )
            return self._fixed(Profile.spline(times, values, degree, ends))
        if not all(filed) or any(inline):
            raise ValueProblem(f"found {sorted(table)} in a table; give times and values, or file and column")
        name, column = str(table["file"]), str(table["column"])
        return Motion(
            profile=lambda folder: Profile.spline(*column_of(folder / name, column, self.unit), degree, ends),
            files=(name,),
        )

    def _record(self, table: dict[str, Any]) -> Motion:
        name, column = str(table["file"]), table.get("column")
        baseline = checked_word(table.get("baseline", "rest"), BASELINES, "baseline", " of a record")
        factor, start = self._value(table, "factor", "", 1.0), self._value(table, "start", "s")

        def profile(folder: Path) -> Profile:
            times, acceleration = read_record(
                folder / name, None if column is None else str(column), f"{self.unit}/s^2"
            )
            shift = start - times[0] if "start" in table else 0.0
            return record(times + shift, acceleration, baseline, factor)

        return Motion(profile=profile, files=(name,))

    def _sum(self, table: dict[str, Any]) -> Motion:
        parts = table["parts"]
        if not isinstance(parts, list) or len(parts) < 2:
            raise ValueProblem(f"parts: found {value_text(parts)}; expected a list of at least two motions")
        motions = [self.read_value(part) for part in parts]
        profiles = [motion.profile for motion in motions if motion is not None and motion.profile is not None]
        if len(profiles) < len(parts):
            raise ValueProblem("found 'free' or 'locked' among the parts of a sum; each must be a motion in time")

        def total(folder: Path) -> Profile:
            summed, *further_profiles = (profile(folder) for profile in profiles)
            for further in further_profiles:
                summed = summed + further
            return summed

        files = tuple(name for motion in motions if motion is not None for name in motion.files)
        if not files:
            total(Path())  # raises here if they do not fit together
        return Motion(profile=total, files=files)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the forms."""
        tables = [
            {
                "type": "object",
                "properties": {
                    "kind": {"const": kind, "description": MEANINGS[kind]["kind"]},
                    **{key: {"description": MEANINGS[kind][key]} for key in keys},
                },
                "required": ["kind", *NEEDED.get(kind, ())],
                "additionalProperties": False,
            }
            for kind, keys in KEYS.items()
        ]
        return {"anyOf": [{"enum": [FREE, LOCKED]}, Quantity(self.unit).json_schema(), *tables], "unit": self.unit}


def _coefficient(value: Any, unit: str) -> float:
    """A coefficient in SI; above jerk only plain numbers."""
    if unit not in NOUNS and isinstance(value, str):
        raise ValueProblem(f"coefficients: found {value_text(value)}; write it as a plain number in {unit}")
    return float(Quantity(unit if unit in NOUNS else "").read_value(value))
