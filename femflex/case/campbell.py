"""[campbell], the speeds of a steady spin at which frequencies are reported, and [stability], the values of charts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, ValidationError, field_validator, model_validator

from femflex.case.sweep import Scattered, numbers_of
from femflex.noun.problems import CaseError
from femflex.noun.sentences import schema_problems
from femflex.noun.table import Table, refuse
from femflex.noun.units import UnitError, split_quantity, to_si
from femflex.noun.values import Count, Direction, Duration, Quantity, ValueProblem, Whole, _Readable, value_text

SI = "rad/s"
LONGEST = 10_000  # speeds: more are taken for a mistake


class Speeds(tuple[float, ...]):
    """Rising speeds [rad/s], and the unit in which the case gives them."""

    unit: str = SI

    @classmethod
    def from_numbers(cls, speeds: Sequence[float], unit: str = SI) -> Speeds:
        """Checked speeds [rad/s], written in that unit."""
        out = cls(float(speed) for speed in speeds)
        out.unit = unit
        if len(out) < 2:
            raise ValueProblem(f"found {len(out)} speed; a diagram needs at least two, such as '0:400 rpm:17'")
        if not all(math.isfinite(speed) for speed in out) or out[0] < 0:
            raise ValueProblem(f"found speeds from {out[0] / out.scale:g} {unit}; they begin at 0 or above, and end")
        if any(b <= a for a, b in pairwise(out)):
            raise ValueProblem(
                f"found speeds that do not rise: {', '.join(f'{v / out.scale:g}' for v in out[:6])} {unit}; give each "
                "one once, the lowest first"
            )
        return out

    @property
    def scale(self) -> float:
        """One of the unit in rad/s."""
        return to_si(f"1 {self.unit}", SI)


class SpeedsValue(_Readable):
    """Speeds as "first:last unit:number", as a list, or as text with commas."""

    def read_value(self, value: Any) -> Speeds:
        """The speeds in rad/s."""
        if isinstance(value, Speeds):
            return value
        if isinstance(value, (list, tuple)):
            unit = next((split_quantity(entry)[1] for entry in value if isinstance(entry, str)), "")
            return Speeds.from_numbers(Quantity(SI, (None,)).read_value(value), unit or SI)
        if not isinstance(value, str):
            raise ValueProblem(f"found {value_text(value)}; {EXPECTED}")
        return _speed_range(value) if ":" in value else _speed_list(value)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the forms."""
        text = {"type": "string", "description": "such as '0:400 rpm:17': first, last with its unit, how many"}
        return {"anyOf": [text, Quantity(SI, (None,)).json_schema()], "unit": SI}


EXPECTED = "expected speeds such as '0:400 rpm:17' (first, last with its unit, how many), or a list of them"


def _speed_range(text: str) -> Speeds:
    parts = [part.strip() for part in text.split(":")]
    if len(parts) != 3 or not all(parts):
        raise ValueProblem(f"found {text!r}; {EXPECTED}")
    if not parts[2].isdigit() or not 2 <= int(parts[2]) <= LONGEST:
        raise ValueProblem(f"found {parts[2]!r} speeds in {text!r}; give a whole number from 2 to {LONGEST}")
    (start, end), unit = _in_one_unit(parts[:2])
    n = int(parts[2])
    return Speeds.from_numbers([start + (end - start) * k / (n - 1) for k in range(n)], unit)


def _speed_list(text: str) -> Speeds:
    parts = [part.strip() for part in text.split(",")]
    if not all(parts):
        raise ValueProblem(f"found {text!r}; {EXPECTED}")
    return Speeds.from_numbers(*_in_one_unit(parts))


def _in_one_unit(parts: list[str]) -> tuple[list[float], str]:
    """Numbers in rad/s, and the unit; numbers without a unit have that of the last one."""
    try:
        pairs = [split_quantity(part, SI) for part in parts]
        unit = pairs[-1][1] or SI
        return [
            to_si(part if own_unit else f"{part} {unit}", SI) for part, (_, own_unit) in zip(parts, pairs, strict=True)
        ], unit
    except UnitError as problem:
        raise ValueProblem(f"{problem}; {EXPECTED}") from None


class CampbellTable(Table):
    """Frequencies over the speed of a steady spin, as `femflex campbell` and `femflex run` tell and draw them."""

    speeds: Annotated[Speeds, SpeedsValue()]
    """Speeds of the steady spin: "first:last unit:number", such as "0:400 rpm:17", or a list."""
    axis: Direction | None = None
    """Axis of the spin, in the frame that spins. Default: that of [attitude] spin."""
    modes: Whole = 6
    """Number of lowest modes at each speed whose branches are followed."""
    orders: Annotated[tuple[Whole, ...], Field(min_length=1)] = (1, 2, 3, 4)
    """Multiples of the speed whose crossings are reported: 1/rev, 2/rev, ..."""

    @field_validator("axis")
    @classmethod
    def _has_a_direction(cls, axis: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        if axis is not None and not any(axis):
            refuse("found an axis of no length; give a direction such as [0, 0, 1]")
        return axis


RATIOS = ("k_roll", "k_yaw")
MAX_POINTS = 2001  # points along one value


class AxisTable(Table):
    """A value of the case over which stability is charted."""

    between: Annotated[list[Scattered], Field(min_length=2, max_length=2)]
    """First and last value, in one unit."""
    points: Annotated[int, Count(2)] = 41
    """Number of values, evenly spaced."""

    @model_validator(mode="after")
    def _rises(self) -> AxisTable:
        start, end, _ = self.numbers()
        if not start < end:
            refuse(f"found between = {self.between}; the second must be above the first")
        if self.points > MAX_POINTS:
            refuse(f"found {self.points} points; give at most {MAX_POINTS}")
        return self

    def numbers(self) -> tuple[float, float, str]:
        """First and last value and their unit as it is written, "" for plain numbers."""
        return numbers_of(self.between)


class StabilityTable(Table):
    """Stability over one value (a locus) or two values (a chart), as `femflex stability` prints and draws it."""

    of: Literal["equilibrium", "motion"] = "equilibrium"
    """What is judged: the equilibrium by its poles, or the periodic motion by its Floquet multipliers."""
    vary: Annotated[dict[str, AxisTable], Field(min_length=1, max_length=2)]
    """Key path in the case, such as "joints.0.damping", and its range; one or two of them. With `inertia` the keys are
    "k_roll" and "k_yaw"."""
    inertia: str | None = None
    """Rigid body whose moments of inertia give the undeformed craft the inertia ratios
    k_roll = (I_pitch - I_yaw) / I_roll and k_yaw = (I_pitch - I_roll) / I_yaw; I_pitch of the craft stays."""
    period: Duration | None = None
    """Period of the motion. Default: that of the orbit, or one turn of the spinning frame."""
    shooting: StrictBool = False
    """Find the periodic motion near the initial state first. Default: the motion begins at the initial state."""
    without: list[str] = Field(default_factory=list)
    """Terms that a second chart or locus omits, as in `run --without`, such as "flexibility"; drawn in dashed lines."""

    @model_validator(mode="after")
    def _keys_fit_quantity(self) -> StabilityTable:
        ratios = [key for key in self.vary if key in RATIOS]
        if self.inertia is None and ratios:
            refuse(f"found {ratios[0]!r} without inertia; name the body whose moments of inertia change")
        if self.inertia is not None and set(self.vary) != set(RATIOS):
            refuse(f"found inertia with vary of {', '.join(self.vary)}; it goes with k_roll and k_yaw, both")
        if self.of == "equilibrium" and (self.period is not None or self.shooting):
            refuse("found period or shooting with of = 'equilibrium'; they go with of = 'motion'")
        return self


def stability_table(keys: dict[str, Any], origin: str) -> StabilityTable:
    """The table of these keys. Raises CaseError with all its problems; origin: source of the keys, for messages."""
    try:
        return StabilityTable.model_validate(keys)
    except ValidationError as error:
        raise CaseError(origin, schema_problems(StabilityTable, keys, error)) from None
