"""File of a sweep: the values of a case that vary, their distribution, and the outputs kept of every run."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from femflex.measures.measure import OF_CAMPBELL, MeasureTable
from femflex.noun.problems import CaseError, Problem
from femflex.noun.sentences import schema_problems
from femflex.noun.table import Table, exactly_one, refuse
from femflex.noun.units import UnitError, split_quantity
from femflex.noun.values import Count, Quantity, ValueProblem, Whole, _Readable, value_text

Design = Literal["grid", "list", "random", "latin_hypercube", "sobol", "sobol_indices"]
DRAWN = ("random", "latin_hypercube", "sobol", "sobol_indices")


class _Number(_Readable):
    """A number, or a text with a unit, as it is written."""

    def read_value(self, value: Any) -> float | str:
        """The number, or the text."""
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueProblem(f"found {value_text(value)}; expected a number or a string such as '3 kg'")
        return value

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both."""
        return {"anyOf": [{"type": "number"}, {"type": "string"}]}


Scattered = Annotated[float | str, _Number()]


class VaryTable(Table):
    """Variation of one value of a case."""

    values: Annotated[list[Any] | None, Field(min_length=1)] = None
    """Values as the case file writes them, for the designs grid and list."""
    between: Annotated[list[Scattered] | None, Field(min_length=2, max_length=2)] = None
    """Lowest and highest value; uniform between."""
    normal: Annotated[list[Scattered] | None, Field(min_length=2, max_length=2)] = None
    """Mean and standard deviation of a normal scatter."""

    @model_validator(mode="after")
    def _one_distribution(self) -> VaryTable:
        key = exactly_one(self, ("values", "between", "normal"))
        if key in ("between", "normal"):
            lower, upper, _ = self.numbers()
            if key == "between" and not lower < upper:
                refuse(f"found between = {self.between}; the second must be above the first")
            if key == "normal" and not upper > 0:
                refuse(f"found normal = {self.normal}; the standard deviation must be above 0")
        return self

    def numbers(self) -> tuple[float, float, str]:
        """The two numbers of a scatter and their unit as it is written, "" for plain numbers."""
        return numbers_of(self.between or self.normal or [0.0, 0.0])


def numbers_of(pair: Sequence[float | str]) -> tuple[float, float, str]:
    """Two numbers and their unit as it is written, "" for plain numbers; a problem of the table for two units."""
    try:
        (a, unit), (b, second_unit) = (split_number(value) for value in pair)
    except UnitError as error:
        refuse(f"found {pair}: {error}")
    if unit != second_unit:
        refuse(f"found {pair}, in two units; write both in one")
    return a, b, unit


def split_number(value: float | str) -> tuple[float, str]:
    """A value's number and its unit as written.

    >>> split_number("3 kg")
    (3.0, 'kg')
    """
    return split_quantity(value) if isinstance(value, str) else (float(value), "")


class SweepTable(Table):
    """A sweep: many runs of one case."""

    case: str
    """Case file, from the folder of this file."""
    design: Design = "grid"
    """How values are combined: grid (all with all), list (first with first, and so on), random, latin_hypercube,
    sobol (quasi-random), or sobol_indices (also gives the share of every value in the variance of the outputs)."""
    members: Whole | None = None
    """Number of runs, for random, latin_hypercube and sobol. For sobol_indices a power of 2: with k values it takes
    members x (k + 2) runs."""
    seed: Annotated[int, Count(0, 2**64 - 1)] = 0
    """Seed of the scatter."""
    vary: Annotated[dict[str, VaryTable], Field(min_length=1)]
    """Key path in the case, such as "bodies.hub.mass", "joints.hinge.stiffness" or "loads.0.torque.1", and how its
    value varies. Entries of a list go by their name, or by their number from 0."""
    outputs: Annotated[dict[str, MeasureTable], Field(default_factory=dict)]
    """Numbers that are kept of every run, by name."""
    histories: Annotated[list[str], Field(default_factory=list)]
    """Channels that are kept over time, one component each, such as "attitude/angles:y"."""
    percentiles: Annotated[tuple[float, ...], Quantity("", (None,), least=0.0, most=100.0)] = (5.0, 50.0, 95.0)
    """Percentiles of outputs and histories over all runs."""

    @model_validator(mode="after")
    def _keys_fit_design(self) -> SweepTable:
        is_random = self.design in DRAWN
        if is_random != (self.members is not None):
            preposition = "without" if is_random else "with"
            refuse(f"found design = {self.design!r} {preposition} members; they go with {', '.join(DRAWN)}")
        if self.design == "sobol_indices" and (
            (self.members or 0) < 2 or (self.members or 0) & ((self.members or 0) - 1)
        ):
            refuse(f"found members = {self.members}; design = 'sobol_indices' needs a power of 2, such as 64")
        for path, table in self.vary.items():
            if is_random == (table.values is not None):
                required_key = "between or normal" if is_random else "values"
                refuse(f"found design = {self.design!r}, which needs {required_key} for {path!r}")
        counts = {path: len(table.values or ()) for path, table in self.vary.items()}
        if self.design == "list" and len(set(counts.values())) > 1:
            refuse(
                f"found lists of different lengths: {counts}; design = 'list' takes the first of all, then the second"
            )
        if not (self.outputs or self.histories):
            refuse("found neither outputs nor histories; name what is to be kept")
        for name, quantity in self.outputs.items():
            if not name.strip(". ") or "/" in name:
                refuse(f"found an output named {name!r}; give a name without '/' that is not of dots alone")
            if quantity.of == OF_CAMPBELL:
                refuse(f"found of = {OF_CAMPBELL!r} for {name!r}; a sweep looks at runs, bodies and modes")
        return self


def read_sweep(path: str | Path) -> tuple[SweepTable, str]:
    """A sweep's table, and its text. Raises CaseError with all problems of the file."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise CaseError(path.name, [Problem("", "there is no such file; give the name of a sweep (TOML)")]) from None
    except (UnicodeDecodeError, OSError) as error:
        raise CaseError(path.name, [Problem("", f"this file cannot be read as text: {error}")]) from None
    return parse_sweep(text, path.name), text


def parse_sweep(text: str, name: str = "sweep.toml") -> SweepTable:
    """The table in the text of a sweep. Raises CaseError with all problems of the text."""
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CaseError(name, [Problem("", f"this is no TOML file: {error}")]) from None
    if "bodies" in raw and "case" not in raw:
        text = "this is a case; a sweep is a file of its own, whose `case` names the case and whose [vary] its values"
        raise CaseError(name, [Problem("", text)])
    try:
        return SweepTable.model_validate(raw)
    except ValidationError as error:
        raise CaseError(name, schema_problems(SweepTable, raw, error)) from None
