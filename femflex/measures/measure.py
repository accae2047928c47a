"""Quantities of a run or of a body, as [expect] and [study] define them, and [expect] itself."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, StrictBool, model_validator

from femflex.noun.table import Table, exactly_one, refuse
from femflex.noun.units import to_base
from femflex.noun.values import (
    Count,
    Quantity,
    Time,
    ValueProblem,
    Whole,
    _Readable,
    as_float,
    check_magnitude,
    value_text,
)

OF_BODY = ("mode_frequency", "body_mass")
OF_CAMPBELL = "campbell_frequency"
OF_SYSTEM = "system_frequency"
OF_JITTER = "jitter"
UNIT_OF = {  # the unit first, then other permitted units
    "body_mass": ("kg",),
    "mode_frequency": ("Hz", "rad/s"),
    "campbell_frequency": ("Hz", "rad/s"),
    "system_frequency": ("Hz", "rad/s"),
}
Reduction = Literal[
    "value",
    "change",
    "peak",
    "maximum",
    "minimum",
    "range",
    "mean",
    "rms",
    "drift",
    "frequency",
    "mode_frequency",
    "body_mass",
    "campbell_frequency",
    "system_frequency",
    "jitter",
]


class NumberWithUnit(float):
    """A number in SI with its base unit as text ("m s^-1"); None for plain numbers."""

    unit: str | None = None

    @classmethod
    def from_number(cls, number: float, unit: str | None) -> NumberWithUnit:
        """The number with its unit."""
        out = cls(number)
        out.unit = unit
        return out


class AnyUnit(_Readable):
    """A number in SI, or a string with any known unit."""

    def read_value(self, value: Any) -> NumberWithUnit:
        """The number in base SI, with the unit in which the case gives it."""
        if isinstance(value, str):
            out = NumberWithUnit.from_number(*to_base(value))
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueProblem(f"found {value_text(value)}; expected a number in SI or a string with a unit")
        else:
            out = NumberWithUnit(as_float(value))
        check_magnitude(out)
        return out

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema."""
        return {"anyOf": [{"type": "number"}, {"type": "string", "description": "with a unit"}]}


Expected = Annotated[NumberWithUnit | None, AnyUnit()]


class _Component(_Readable):
    """Name of an entry, or its number from 0."""

    def read_value(self, value: Any) -> str | int:
        """The name or number."""
        return value if isinstance(value, str) else Count(0).read_value(value)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both."""
        return {"anyOf": [{"type": "string"}, Count(0).json_schema()]}


class MeasureTable(Table):
    """One number taken from a run's channel, from a body, or from the whole craft."""

    of: Reduction = "value"
    """How the number is formed. Of a channel: value, change (end minus start), peak (largest magnitude), maximum,
    minimum, range, mean, rms, drift (largest departure from the start), or frequency. A value is that at time `at`.
    A frequency [Hz] comes from crossings of the mean, or from a fit of `tones` sinusoids. Of a body:
    mode_frequency [Hz] or body_mass [kg]. Of the craft: campbell_frequency [Hz], system_frequency [Hz],
    or jitter, the root mean square of an output of [jitter]."""
    channel: str | None = None
    """Path in the result file, such as "markers/boom.tip/deflection"."""
    component: Annotated[str | int | None, _Component()] = None
    """Name or number (from 0) of the component. Default: the magnitude of a vector."""
    at: Time | None = None
    """Time of the value, for of = "value". Default: the end of the run."""
    start: Time | None = None
    """First time that counts. Default: the start of the run."""
    end: Time | None = None
    """Last time that counts. Default: the end of the run."""
    relative: StrictBool = False
    """Drift as a fraction of the largest magnitude."""
    tones: Whole = 1
    """Number of sinusoids that are fitted; 1 counts mean crossings."""
    tone: Whole = 1
    """Number of the sinusoid that is reported, by rising frequency."""
    per_orbit: StrictBool = False
    """Frequency in units of the orbit's mean motion."""
    body: str | None = None
    """Body, for mode_frequency and body_mass."""
    mode: Whole = 1
    """Number of the mode, from 1."""
    branch: str | None = None
    """Name of the branch in the Campbell diagram, such as "flap 1". For system_frequency: name of the mode, in place of
    its number."""
    output: str | None = None
    """Output of [jitter] with its component, such as "camera:y", for of = "jitter"."""
    speed: Annotated[float | None, Quantity("rad/s", least=0.0)] = None
    """Speed of the Campbell diagram at which the frequency is taken; one of its speeds."""

    @model_validator(mode="after")
    def _keys_fit_quantity(self) -> MeasureTable:
        of_campbell = self.of == OF_CAMPBELL
        of_system, of_jitter = self.of == OF_SYSTEM, self.of == OF_JITTER
        if (self.output is not None) != of_jitter:
            refuse(f"found of = {self.of!r} {'with' if self.output else 'without'} output; it goes with of = 'jitter'")
        if [self.branch is not None and not of_system, self.speed is not None] != [of_campbell] * 2:
            refuse(f"found of = {self.of!r}; branch and speed go with of = {OF_CAMPBELL!r}, which needs both")
        if (of_campbell or of_system or of_jitter) and (self.channel is not None or self.body is not None):
            refuse(f"found of = {self.of!r} with a channel or a body; it is a quantity of the whole craft")
        if self.of in OF_BODY:
            if self.body is None:
                refuse(f"found of = {self.of!r} without body; name the body")
            if self.channel is not None:
                refuse(f"found of = {self.of!r} with a channel; it is a quantity of the body alone")
        elif self.channel is None and not (of_campbell or of_system or of_jitter):
            refuse(f"found of = {self.of!r} without channel; name a channel such as 'attitude/angles'")
        if self.at is not None and self.of != "value":
            refuse(f"found `at` together with of = {self.of!r}; `at` goes with of = 'value'")
        if self.tone > self.tones:
            refuse(f"found tone = {self.tone} and tones = {self.tones}; tone is at most tones, so raise `tones`")
        if self.relative and self.of != "drift":
            refuse(f"found `relative` together with of = {self.of!r}; it goes with of = 'drift'")
        if self.start is not None and self.end is not None and self.start > self.end:
            refuse(f"found start = {self.start:g} s after end = {self.end:g} s; start comes first")
        return self


class ExpectTable(MeasureTable):
    """A measured quantity and its expected value or limits."""

    value: Expected = None
    """Expected value."""
    tolerance: Expected = None
    """Largest permitted difference from the value."""
    relative_tolerance: Annotated[float | None, Quantity("", above=0.0)] = None
    """Largest permitted difference from the value, as a fraction of it."""
    above: Expected = None
    """Lower limit; the measured number must exceed it."""
    below: Expected = None
    """Upper limit; the measured number must stay below it."""
    source: str = ""
    """Origin of the expected value."""

    def units(self) -> dict[str, str]:
        """Base unit of each number that the case gives with a unit."""
        numbers = {key: getattr(self, key) for key in ("value", "tolerance", "above", "below")}
        return {key: n.unit for key, n in numbers.items() if isinstance(n, NumberWithUnit) and n.unit is not None}

    @model_validator(mode="after")
    def _has_an_answer(self) -> ExpectTable:
        if self.value is None and self.above is None and self.below is None:
            refuse("found no expected value; give value with tolerance, or above, or below")
        if (self.value is not None) != (self.tolerance is not None or self.relative_tolerance is not None):
            refuse("found value without tolerance, or a tolerance without value; they belong together")
        exactly_one(self, ("tolerance", "relative_tolerance"), required=False)
        if self.tolerance is not None and self.tolerance <= 0:
            refuse(f"found a tolerance of {self.tolerance:g}; it must be above 0")
        if self.relative_tolerance is not None and self.value is not None and float(self.value) == 0.0:
            refuse("found relative_tolerance for an expected value of 0; give tolerance")
        if len(set(self.units().values())) > 1:
            refuse(
                "found units that do not belong together: "
                + ", ".join(f"{key} in {u or 'plain numbers'}" for key, u in self.units().items())
            )
        permitted = UNIT_OF.get(self.of)
        for key, unit in self.units().items():
            if permitted is not None and unit not in {
                to_base(f"1 {permitted_unit}")[1] for permitted_unit in permitted
            }:
                refuse(f"found {key} in {unit or 'plain numbers'}; {self.of} is in {permitted[0]}")
        if self.above is not None and self.below is not None and not self.above < self.below:
            refuse(f"found above = {self.above:g} and below = {self.below:g}, between which nothing lies")
        return self


class ExpectationsTable(Table):
    """[expect]: the case's own answers, by name."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, ExpectTable]

    slow: StrictBool = False
    """The run takes longer than a quick test; it runs in the slow suite."""

    @property
    def answers(self) -> dict[str, ExpectTable]:
        """Name -> expected quantity."""
        return dict(self.__pydantic_extra__ or {})

    @classmethod
    def extra_type(cls) -> type[ExpectTable]:
        """Type of the entries under all keys except the declared ones."""
        return ExpectTable
