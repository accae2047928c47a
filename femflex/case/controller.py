"""[controllers.<name>]: blocks that turn signals into commands, continuous or sampled."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.case.inertia import InertiaMatrix
from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Count, Duration, Positive, Quantity, ValueProblem, _Readable

Numbers = tuple[float, ...]
Rows = tuple[Numbers, ...]


class _NumberOrList(_Readable):
    """A number, or a list of numbers: one per channel."""

    def __init__(self, above: float = -math.inf) -> None:
        self.scalar, self.vector = Quantity(above=above), Quantity("", (None,), above=above)

    def read_value(self, value: object) -> object:
        """The numbers as a tuple."""
        return self.vector.read_value(value) if isinstance(value, list) else (self.scalar.read_value(value),)

    def json_schema(self) -> dict[str, object]:
        """JSON Schema of both forms."""
        return {"anyOf": [self.scalar.json_schema(), self.vector.json_schema()]}


Gains = Annotated[Numbers, _NumberOrList()]
Limits = Annotated[Numbers, _NumberOrList(above=0.0)]


class _Matrix(_Readable):
    """Rows of numbers, as many in each."""

    def read_value(self, value: object) -> object:
        """The rows as tuples."""
        rows = Quantity("", (None, None)).read_value(value)
        lengths = [len(row) for row in rows]
        if len(set(lengths)) > 1:
            k = next(k for k, length in enumerate(lengths) if length != lengths[0])
            raise ValueProblem(
                f"row 1 has {lengths[0]} and row {k + 1} has {lengths[k]} numbers; give as many in every row"
            )
        return rows

    def json_schema(self) -> dict[str, object]:
        """JSON Schema of the rows."""
        return Quantity("", (None, None)).json_schema()


MatrixRows = Annotated[Rows, _Matrix()]


class BlockTable(Table):
    """Keys that all controllers share. Numbers are in SI units."""

    outputs: list[Name] | None = None
    """Names of the outputs. Default: x, y, z of three, y of one, else y1, y2 and so on."""
    period: Duration | None = None
    """Time between two samples; commands are held between them. Default: continuous."""


class LinearTable(BlockTable):
    """Keys that all linear controllers share."""

    inputs: Annotated[list[str], Field(min_length=1)]
    """Signals, such as "gyro.x"; a name alone, such as "gyro", stands for all its outputs."""
    limit: Limits | None = None
    """Largest size of every output, or of each. Default: none."""
    scaled: StrictBool = False
    """Beyond a limit all outputs are scaled down together, which keeps their ratios."""

    @model_validator(mode="after")
    def _scaling_needs_a_limit(self) -> LinearTable:
        if self.scaled and self.limit is None:
            refuse("found scaled without limit; give the limit to which the outputs are scaled down, or drop scaled")
        return self


class PdTable(LinearTable):
    """y = -stiffness e - damping w; inputs are the errors e, then as many rates w."""

    kind: Literal["pd"]
    """Selects this controller: proportional and derivative."""
    stiffness: Gains
    """Gain on each error."""
    damping: Gains
    """Gain on each rate."""


class PidTable(LinearTable):
    """y = -stiffness e - integral int e dt - damping w; inputs are the errors e, then as many rates w."""

    kind: Literal["pid"]
    """Selects this controller: proportional, integral and derivative."""
    stiffness: Gains
    """Gain on each error."""
    integral: Gains
    """Gain on the integral of each error."""
    damping: Gains
    """Gain on each rate."""


class LowPassTable(LinearTable):
    """A low-pass filter of every input."""

    kind: Literal["low_pass"]
    """Selects this controller: a low-pass filter."""
    frequency: Annotated[float, Quantity("Hz", above=0.0)]
    """Corner frequency."""
    order: Annotated[int, Count(1, 2)] = 1
    """Order of the filter."""
    damping: Positive = 0.7071067811865476
    """Damping ratio of a filter of order 2."""


class NotchTable(LinearTable):
    """A notch filter of every input: (s^2 + 2 depth width w s + w^2) / (s^2 + 2 width w s + w^2)."""

    kind: Literal["notch"]
    """Selects this controller: a notch filter."""
    frequency: Annotated[float, Quantity("Hz", above=0.0)]
    """Frequency that is left out."""
    width: Positive = 1.0
    """Damping ratio of the denominator."""
    depth: Annotated[float, Quantity(least=0.0, below=1.0)] = 0.0
    """Gain at the frequency."""


class StateSpaceTable(LinearTable):
    """dx/dt = A x + B u, y = C x + D u."""

    kind: Literal["state_space"]
    """Selects this controller: a linear system."""
    A: MatrixRows
    """System matrix."""
    B: MatrixRows
    """Input matrix."""
    C: MatrixRows
    """Output matrix."""
    D: MatrixRows | None = None
    """Feedthrough matrix. Default: zero."""


class ObserverTable(LinearTable):
    """State feedback over an observer: dx/dt = A x + B v + correction (y - C x), v = -feedback x."""

    kind: Literal["observer"]
    """Selects this controller: an observer with state feedback."""
    A: MatrixRows
    """System matrix of the plant."""
    B: MatrixRows
    """Input matrix of the plant."""
    C: MatrixRows
    """Output matrix of the plant."""
    feedback: MatrixRows
    """Gain of the state feedback."""
    correction: MatrixRows
    """Gain of the observer."""


class GainTable(LinearTable):
    """y = matrix u."""

    kind: Literal["gain"]
    """Selects this controller: a matrix."""
    matrix: MatrixRows
    """Gain matrix, one row per output."""


class AllocationTable(LinearTable):
    """Commands of least size with a demanded effect, by the pseudo-inverse of `effect`."""

    kind: Literal["allocation"]
    """Selects this controller: shares demands among actuators."""
    effect: MatrixRows
    """Effect of a unit of each command (columns) on each demand (rows); of a wheel's torque minus its axis."""


class MomentumTable(LinearTable):
    """Torque demand -rate H for the momentum H = effect h of wheels; inputs are the h."""

    kind: Literal["momentum"]
    """Selects this controller: unloads wheels."""
    rate: Annotated[float, Quantity("1/s", above=0.0)]
    """Rate at which momentum is to fall."""
    effect: MatrixRows
    """Axes of the wheels as columns."""


class AttitudeFeedbackTable(BlockTable):
    """Quaternion feedback: torque -stiffness e - damping omega + omega x (inertia omega + H)."""

    kind: Literal["attitude"]
    """Selects this controller: quaternion feedback."""
    error: str
    """Attitude sensor."""
    rate: str
    """Rate sensor with the same axes."""
    stiffness: Gains
    """Gain on the error, one number or one per axis."""
    damping: Gains
    """Gain on the rate, one number or one per axis."""
    inertia: InertiaMatrix | None = None
    """Inertia of the gyroscopic torque that is compensated. Default: none."""
    momentum: list[str] | None = None
    """Signals of the momentum of wheels in the same axes. Default: none."""
    limit: Positive | None = None
    """Largest size of each component. Default: none."""


class PulsesTable(Table):
    """On-off commands whose mean over each period is demand / full."""

    kind: Literal["pulses"]
    """Selects this controller: pulse-width modulation of thrusters."""
    inputs: Annotated[list[str], Field(min_length=1)]
    """Demanded forces, one per thruster; below zero counts as zero."""
    outputs: Annotated[list[Name], Field(min_length=1)]
    """Names of the commands, one per thruster."""
    full: Limits
    """Force of each thruster at full thrust."""
    period: Duration
    """Time between two samples."""
    minimum_on: Annotated[float, Quantity("s", least=0.0)] = 0.0
    """Shortest pulse; shorter ones are left out."""

    @model_validator(mode="after")
    def _pulse_is_shorter_than_period(self) -> PulsesTable:
        if self.minimum_on >= self.period:
            refuse(f"found minimum_on {self.minimum_on:g} s, and a period of {self.period:g} s; it must be shorter")
        return self


Controller = Annotated[
    PdTable
    | PidTable
    | LowPassTable
    | NotchTable
    | StateSpaceTable
    | ObserverTable
    | GainTable
    | AllocationTable
    | MomentumTable
    | AttitudeFeedbackTable
    | PulsesTable,
    Field(discriminator="kind"),
]
