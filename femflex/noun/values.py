"""Types of the values in a case file: numbers with units, vectors, matrices, and tables and formulas along a member.

Each is a marker for pydantic: it reads a TOML value, converts it to SI and reports an error in one sentence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from femflex.noun.problems import suggestion_text
from femflex.noun.units import UnitError, example, quantity_noun, to_si

MOST_FUNCTIONS = 1000  # for one field of a beam; more functions equal each other to rounding
FARTHEST = 1e12  # m, of a position: seven times the distance of the Sun
SMALLEST, LARGEST = 1e-30, 1e30  # SI; products of several such numbers are still far from overflow and underflow


class ValueProblem(ValueError):
    """An invalid value of a case file; the text begins with the value found."""


class _Readable:
    """A marker whose `read_value` returns the typed value of a TOML value and raises ValueProblem with a sentence."""

    def read_value(self, value: Any) -> Any:
        raise NotImplementedError

    def json_schema(self) -> dict[str, Any]:
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(_as_validator(self.read_value))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return self.json_schema()


def _as_validator(read_value: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def validate(value: Any) -> Any:
        try:
            return read_value(value.tolist() if hasattr(value, "tolist") else value)  # of numpy
        except (ValueProblem, UnitError) as problem:
            raise PydanticCustomError("value", "{text}", {"text": str(problem)}) from None

    return validate


@dataclass(frozen=True)
class Quantity(_Readable):
    """A number, vector or table of numbers with one unit, within bounds.

    unit   key of femflex.noun.units.NOUNS; plain numbers are in it
    shape  () for a number, (3,) for a vector, (None, 3) for rows of three
    above, below  bounds not reached; least, most  bounds that may be reached
    """

    unit: str = ""
    shape: tuple[int | None, ...] = ()
    above: float = -math.inf
    below: float = math.inf
    least: float = -math.inf
    most: float = math.inf

    def read_value(self, value: Any) -> Any:
        """The value in SI: a float, or nested tuples of floats."""
        return self._read_entries(value, self.shape)

    def _read_entries(self, value: Any, shape: tuple[int | None, ...]) -> Any:
        value = value.tolist() if hasattr(value, "tolist") else value  # of numpy
        if not shape:
            return self._number(value)
        if not isinstance(value, (list, tuple)):
            raise ValueProblem(f"found {value_text(value)}; expected {self._expected_text(shape)}")
        if (shape[0] is not None and len(value) != shape[0]) or not value:
            raise ValueProblem(
                f"found {counted_noun(len(value), 'entry', 'entries')}; expected {self._expected_text(shape)}"
            )
        out, problems = [], []
        for k, entry in enumerate(value):
            try:
                out.append(self._read_entries(entry, shape[1:]))
            except (ValueProblem, UnitError) as problem:
                entry_text = f"entry {k + 1}" if len(shape) == 1 else f"row {k + 1}"
                problems.append(f"{entry_text}: {problem}")
        if problems:
            raise ValueProblem(
                "; ".join(problems[:3]) + (f"; and {len(problems) - 3} more" if len(problems) > 3 else "")
            )
        return tuple(out)

    def _number(self, value: Any) -> float:
        if isinstance(value, str):
            number = to_si(value, self.unit)
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueProblem(f"found {value_text(value)}; expected {self._expected_text(())}")
        else:
            number = as_float(value)
        unit = f" {self.unit}" if self.unit else ""
        check_magnitude(number, unit)
        if not self.above < number:
            raise ValueProblem(f"found {number:g}{unit}; it must be above {self.above:g}{unit}")
        if not number < self.below:
            raise ValueProblem(f"found {number:g}{unit}; it must be below {self.below:g}{unit}")
        if not self.least <= number <= self.most:
            side, bound = ("at least", self.least) if number < self.least else ("at most", self.most)
            raise ValueProblem(f"found {number:g}{unit}; it must be {side} {bound:g}{unit}")
        return number

    def _expected_text(self, shape: tuple[int | None, ...]) -> str:
        number_text = f"{quantity_noun(self.unit)}, a number" + (
            f" in {self.unit} or a string such as {example(self.unit)!r}" if self.unit else ""
        )
        if not shape:
            return number_text
        outer = "".join(f"{'' if size is None else f'{size} '}lists of " for size in shape[:-1])
        sizes = f"a list of {outer}{'' if shape[-1] is None else f'{shape[-1]} '}numbers"
        return sizes + (f" in {self.unit}, or strings such as {example(self.unit)!r}" if self.unit else "")

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the value; `unit` names the SI unit of plain numbers."""
        bounds = {
            "exclusiveMinimum": self.above,
            "exclusiveMaximum": self.below,
            "minimum": self.least,
            "maximum": self.most,
        }
        number: dict[str, Any] = {"type": "number"} | {key: b for key, b in bounds.items() if math.isfinite(b)}
        unit = self.unit or "1"
        out: dict[str, Any] = {
            "anyOf": [number, {"type": "string", "description": f"with a unit, such as {example(self.unit)!r}"}],
            "unit": unit,
        }
        for size in reversed(self.shape):
            limits = {"minItems": 1} if size is None else {"minItems": size, "maxItems": size}
            out = {"type": "array", "items": out, "unit": unit} | limits
        return out


@dataclass(frozen=True)
class AlongMember(_Readable):
    """A quantity that may vary along a member: a number, a table over arc length, or a formula of s and L.

    Read as a float, a tuple (s, values), or the text of the formula, as femflex.fem.sections.section expects.
    """

    unit: str
    least: float = 0.0

    def read_value(self, value: Any) -> float | str | tuple[tuple[float, ...], tuple[float, ...]]:
        """The number, formula or table in SI."""
        if not isinstance(value, dict):
            return Quantity(self.unit, least=self.least).read_value(value)
        if set(value) == {"formula"} and isinstance(value["formula"], str):
            return str(value["formula"])
        if set(value) != {"s", "values"}:
            raise ValueProblem(
                f"found a table with keys {sorted(value)}; expected {{s = [...], values = [...]}} or "
                f'{{formula = "..."}}'
            )
        s = self._rows("s", Quantity("m", (None,), least=0.0), value)
        values = self._rows("values", Quantity(self.unit, (None,), least=self.least), value)
        if len(s) != len(values) or len(s) < 2:
            numbers_text = (
                f"{counted_noun(len(s), 'arc length', 'arc lengths')} and "
                f"{counted_noun(len(values), 'value', 'values')}"
            )
            raise ValueProblem(f"found {numbers_text}; a table needs as many of both, at least 2")
        if any(b <= a for a, b in pairwise(s)):
            raise ValueProblem(f"found arc lengths {list(s)} m; they must increase")
        return s, values

    @staticmethod
    def _rows(key: str, kind: Quantity, value: Mapping[str, Any]) -> tuple[float, ...]:
        try:
            rows: tuple[float, ...] = kind.read_value(value[key])
            return rows
        except (ValueProblem, UnitError) as problem:
            raise ValueProblem(f"{key}: {problem}") from None

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the three forms."""
        number = Quantity(self.unit, least=self.least)
        rows = {
            "s": Quantity("m", (None,)).json_schema() | {"description": "Arc lengths along the member, rising."},
            "values": Quantity(self.unit, (None,)).json_schema() | {"description": "Values at these arc lengths."},
        }
        table = {"type": "object", "properties": rows, "required": ["s", "values"], "additionalProperties": False}
        text = {"type": "string", "description": "arithmetic of the arc length s and the whole length L, in SI"}
        formula = {
            "type": "object",
            "properties": {"formula": text},
            "required": ["formula"],
            "additionalProperties": False,
        }
        return {"anyOf": [number.json_schema(), table, formula], "unit": self.unit}


@dataclass(frozen=True)
class Count(_Readable):
    """A whole number from `least` to `most`; true and 3.0 give an error."""

    least: int = 1
    most: int = 10**9

    def read_value(self, value: Any) -> int:
        """The whole number."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise ValueProblem(f"found {value_text(value)}; expected a whole number")
        if value < self.least:
            raise ValueProblem(f"found {value}; it must be at least {self.least}")
        if value > self.most:
            raise ValueProblem(f"found {value_text(value)}; it must be at most {self.most}")
        return value

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of a whole number."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


class AxisValue(_Readable):
    """A direction: three numbers not all zero, or "x", "-y" and so on. Read as a unit vector."""

    def read_value(self, value: Any) -> Vector:
        """Its components (3,), of length 1."""
        if isinstance(value, str):
            if value.lstrip("-") not in ("x", "y", "z") or value.count("-") > 1:
                raise ValueProblem(f"found {value!r}; an axis is three numbers, or one of x, y, z, -x, -y, -z")
            value = [(-1.0 if value[0] == "-" else 1.0) * (letter == value[-1]) for letter in "xyz"]
        axis = Quantity("", (3,)).read_value(value)
        if not any(axis):
            raise ValueProblem(f"found {list(axis)}; an axis needs a direction, such as [0, 0, 1] or 'z'")
        length = math.hypot(*axis)
        return axis[0] / length, axis[1] / length, axis[2] / length

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the two forms."""
        return {"anyOf": [Quantity("", (3,)).json_schema(), {"enum": ["x", "y", "z", "-x", "-y", "-z"]}]}


def as_float(value: float) -> float:
    """The number as a float; a whole number beyond the range of floats is infinite."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def check_magnitude(number: float, unit: str = "") -> None:
    """Raise ValueProblem for a number that is not finite, or too large or small for a computation in SI."""
    if not math.isfinite(number):
        raise ValueProblem(f"found {number}; the number must be finite")
    if number and not SMALLEST <= abs(number) <= LARGEST:
        raise ValueProblem(
            f"found {number:g}{unit}; it must be zero, or its magnitude between {SMALLEST:g} and {LARGEST:g} in SI"
        )


def checked_word(value: Any, allowed: Iterable[str], key: str, suffix: str = "") -> str:
    """The value of a key that must be one of some words. Raises ValueProblem for anything else."""
    allowed = tuple(allowed)
    if isinstance(value, str) and value in allowed:
        return value
    if value is None:
        raise ValueProblem(f"key {key!r}{suffix} is missing; {suggestion_text('', allowed)}")
    if isinstance(value, str):
        raise ValueProblem(f"found {key} = {value!r}{suffix}; {suggestion_text(value, allowed)}")
    raise ValueProblem(f"found {key} = {value_text(value)}{suffix}; {suggestion_text('', allowed)}")


def value_text(value: Any) -> str:
    """The value as text for a message: `"abc" (text)`, `true (a truth value)`."""
    kinds: Mapping[type, str] = {
        bool: "a truth value",
        str: "text",
        list: "a list",
        dict: "a table",
        int: "a number",
        float: "a number",
    }
    kind = kinds.get(type(value), f"a {type(value).__name__}")
    text = str(value).lower() if isinstance(value, bool) else repr(value) if type(value) in kinds else str(value)
    return f"{text if len(text) < 60 else text[:57] + '...'} ({kind})"


def counted_noun(n: int, singular: str, plural: str) -> str:
    """Number and noun: "1 entry", "2 entries"."""
    return f"{n} {singular if n == 1 else plural}"


Pair = tuple[float, float]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

Length = Annotated[float, Quantity("m")]
PositiveLength = Annotated[float, Quantity("m", above=0.0)]
Time = Annotated[float, Quantity("s")]
Duration = Annotated[float, Quantity("s", above=0.0)]
Mass = Annotated[float, Quantity("kg", above=0.0)]
Angle = Annotated[float, Quantity("rad")]
Rate = Annotated[float, Quantity("rad/s")]
Plain = Annotated[float, Quantity()]
Positive = Annotated[float, Quantity(above=0.0)]
Fraction = Annotated[float, Quantity(least=0.0, below=1.0)]
Position = Annotated[Vector, Quantity("m", (3,), least=-FARTHEST, most=FARTHEST)]
Velocity = Annotated[Vector, Quantity("m/s", (3,))]
Direction = Annotated[Vector, Quantity("", (3,))]
Axis = Annotated[Vector, AxisValue()]
Angles = Annotated[Vector, Quantity("rad", (3,))]
Rates = Annotated[Vector, Quantity("rad/s", (3,))]
Whole = Annotated[int, Count(1)]
