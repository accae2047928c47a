"""Types of the values a case file holds: numbers with units, vectors, matrices, tables and formulas along a member.

Each is a marker for pydantic: it reads what TOML gives, converts to SI and says in one sentence what is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from femflex.case.problems import near
from femflex.case.units import UnitError, example, noun, to_si

MOST_FUNCTIONS = 1000  # for one field of a beam; beyond it they are the same to rounding
FARTHEST = 1e12  # m, of a place: seven times as far as the Sun
SMALLEST, LARGEST = 1e-30, 1e30  # SI; products of several such numbers are still far from overflow and underflow


class ValueProblem(ValueError):
    """A value of a case file that does not fit; the text begins with what was found."""


class _Readable:
    """A marker whose `read` turns a TOML value into the typed one and raises ValueProblem with a sentence."""

    def read(self, value: Any) -> Any:
        raise NotImplementedError

    def json_schema(self) -> dict[str, Any]:
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(_reporting(self.read))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return self.json_schema()


def _reporting(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def validate(value: Any) -> Any:
        try:
            return read(value)
        except (ValueProblem, UnitError) as problem:
            raise PydanticCustomError("value", "{text}", {"text": str(problem)}) from None

    return validate


@dataclass(frozen=True)
class Quantity(_Readable):
    """A number, vector or table of numbers with one unit, within bounds.

    unit   key of femflex.case.units.NOUNS; plain numbers are in it
    shape  () for a number, (3,) for a vector, (None, 3) for rows of three
    above, below  bounds not reached; least, most  bounds that may be reached
    """

    unit: str = ""
    shape: tuple[int | None, ...] = ()
    above: float = -math.inf
    below: float = math.inf
    least: float = -math.inf
    most: float = math.inf

    def read(self, value: Any) -> Any:
        """The value in SI: a float, or nested tuples of floats."""
        return self._read(value, self.shape)

    def _read(self, value: Any, shape: tuple[int | None, ...]) -> Any:
        if not shape:
            return self._number(value)
        if not isinstance(value, (list, tuple)):
            raise ValueProblem(f"found {shown(value)}; expected {self._wanted(shape)}")
        if (shape[0] is not None and len(value) != shape[0]) or not value:
            raise ValueProblem(f"found {count(len(value), 'entry', 'entries')}; expected {self._wanted(shape)}")
        out, problems = [], []
        for k, entry in enumerate(value):
            try:
                out.append(self._read(entry, shape[1:]))
            except (ValueProblem, UnitError) as problem:
                place = f"entry {k + 1}" if len(shape) == 1 else f"row {k + 1}"
                problems.append(f"{place}: {problem}")
        if problems:
            raise ValueProblem(
                "; ".join(problems[:3]) + (f"; and {len(problems) - 3} more" if len(problems) > 3 else "")
            )
        return tuple(out)

    def _number(self, value: Any) -> float:
        if isinstance(value, str):
            number = to_si(value, self.unit)
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueProblem(f"found {shown(value)}; expected {self._wanted(())}")
        else:
            number = real(value)
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

    def _wanted(self, shape: tuple[int | None, ...]) -> str:
        one = f"{noun(self.unit)}, a number" + (
            f" in {self.unit} or a string such as {example(self.unit)!r}" if self.unit else ""
        )
        if not shape:
            return one
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
class Along(_Readable):
    """A quantity that may vary along a member: number, table over arc length, or formula of s and L.

    Reads into a float, a tuple (s, values), or the formula's text: what femflex.fem.variation takes.
    """

    unit: str
    least: float = 0.0

    def read(self, value: Any) -> float | str | tuple[tuple[float, ...], tuple[float, ...]]:
        """The number, formula or table in SI."""
        if not isinstance(value, dict):
            return Quantity(self.unit, least=self.least).read(value)
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
            found = f"{count(len(s), 'arc length', 'arc lengths')} and {count(len(values), 'value', 'values')}"
            raise ValueProblem(f"found {found}; a table needs as many of both, at least 2")
        if any(b <= a for a, b in pairwise(s)):
            raise ValueProblem(f"found arc lengths {list(s)} m; they must increase")
        return s, values

    @staticmethod
    def _rows(key: str, kind: Quantity, value: Mapping[str, Any]) -> tuple[float, ...]:
        try:
            rows: tuple[float, ...] = kind.read(value[key])
            return rows
        except (ValueProblem, UnitError) as problem:
            raise ValueProblem(f"{key}: {problem}") from None

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the three forms."""
        one = Quantity(self.unit, least=self.least)
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
        return {"anyOf": [one.json_schema(), table, formula], "unit": self.unit}


@dataclass(frozen=True)
class Count(_Readable):
    """A whole number from `least` to `most`; true and 3.0 are not taken for one."""

    least: int = 1
    most: int = 10**9

    def read(self, value: Any) -> int:
        """The whole number."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise ValueProblem(f"found {shown(value)}; expected a whole number")
        if value < self.least:
            raise ValueProblem(f"found {value}; it must be at least {self.least}")
        if value > self.most:
            raise ValueProblem(f"found {shown(value)}; it must be at most {self.most}")
        return value

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of a whole number."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


def real(value: float) -> float:
    """The number as a float; a whole number beyond the range of floats is infinite."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def check_magnitude(number: float, unit: str = "") -> None:
    """Raise ValueProblem for a number that is not finite, or beyond what a computation in SI can hold."""
    if not math.isfinite(number):
        raise ValueProblem(f"found {number}; the number must be finite")
    if number and not SMALLEST <= abs(number) <= LARGEST:
        raise ValueProblem(
            f"found {number:g}{unit}; it must be zero, or its magnitude between {SMALLEST:g} and {LARGEST:g} in SI"
        )


def word(value: Any, known: Iterable[str], key: str, of: str = "") -> str:
    """The value of a key that is one of some words; ValueProblem for anything else."""
    known = tuple(known)
    if isinstance(value, str) and value in known:
        return value
    if value is None:
        raise ValueProblem(f"key {key!r}{of} is missing; {near('', known)}")
    if isinstance(value, str):
        raise ValueProblem(f"found {key} = {value!r}{of}; {near(value, known)}")
    raise ValueProblem(f"found {key} = {shown(value)}{of}; {near('', known)}")


def shown(value: Any) -> str:
    """The value as a message shows it: `"abc" (text)`, `true (a truth value)`."""
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


def count(n: int, one: str, many: str) -> str:
    """Number and noun: "1 entry", "2 entries"."""
    return f"{n} {one if n == 1 else many}"


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
Angles = Annotated[Vector, Quantity("rad", (3,))]
Rates = Annotated[Vector, Quantity("rad/s", (3,))]
Whole = Annotated[int, Count(1)]
