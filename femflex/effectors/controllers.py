"""Controllers: blocks that turn signals into commands, continuous or sampled."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, StrictBool, model_validator

from femflex.arrays import Array
from femflex.effectors import blocks
from femflex.effectors.blocks import StateSpace
from femflex.effectors.noun import EffectorNoun
from femflex.effectors.sensor import Sensor
from femflex.noun.inertia import InertiaMatrix
from femflex.noun.parametric import UNLIMITED
from femflex.noun.problems import suggestion_text
from femflex.noun.table import Name, refuse
from femflex.noun.values import Count, Duration, Positive, Quantity, ValueProblem, _Readable
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector

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


class Block(EffectorNoun):
    """Keys that all controllers share. Numbers are in SI units."""

    n_markers = 0
    label = "controller"
    gives_signals = True

    outputs: list[Name] | None = None
    """Names of the outputs. Default: x, y, z of three, y of one, else y1, y2 and so on."""
    period: Duration | None = None
    """Time between two samples; commands are held between them. Default: continuous."""

    @abstractmethod
    def controller(self, name: str, context: Context) -> Effector | Controller:
        """Return its block as an effector, or as a sampled controller. Raises ValueError."""

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """The controller of that name. Raises ValueError for counts that do not fit, and for unknown signals."""
        return (self.controller(name, context),)


class LinearBlock(Block):
    """Keys that all linear controllers share."""

    inputs: Annotated[list[str], Field(min_length=1)]
    """Signals, such as "gyro.x"; a name alone, such as "gyro", stands for all its outputs."""
    limit: Limits | None = None
    """Largest size of every output, or of each. Default: none."""
    scaled: StrictBool = False
    """Beyond a limit all outputs are scaled down together, which keeps their ratios."""

    per_input: ClassVar[bool] = False  # whether the number of outputs follows that of the inputs

    @model_validator(mode="after")
    def _scaling_needs_a_limit(self) -> LinearBlock:
        if self.scaled and self.limit is None:
            refuse("found scaled without limit; give the limit to which the outputs are scaled down, or drop scaled")
        return self

    @abstractmethod
    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""

    def controller(self, name: str, context: Context) -> Effector | Controller:
        """The block with these matrices. Raises ValueError."""
        inputs = signals_of(self.inputs, context)
        system = self.system(len(inputs))
        n = len(system.D)
        limit = UNLIMITED if self.limit is None else broadcast_gains(self.limit, n)
        outputs = self.outputs or default_outputs(n)
        return blocks.block(name, system, inputs, outputs, period=self.period, limit=limit, scaled=self.scaled)

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Names of its outputs. Raises ValueError where their number depends on itself."""
        if name in path:
            raise ValueError(
                f"algebraic loop: {' -> '.join([*path[path.index(name) :], name])} take all of each other's outputs, "
                f"so that not even their number is known. Name single signals, such as '{name}.y', and take a state or "
                "a sampled number somewhere in the loop"
            )
        if self.outputs is not None:
            return list(self.outputs)
        n = len(signals_of(self.inputs, context, (*path, name))) if self.per_input else 0
        return default_outputs(len(self.system(n).D))


class Pd(LinearBlock, heading="controllers"):
    """y = -stiffness e - damping w; inputs are the errors e, then as many rates w."""

    kind: Literal["pd"] = "pd"
    """Selects this controller: proportional and derivative."""
    stiffness: Gains
    """Gain on each error."""
    damping: Gains
    """Gain on each rate."""

    per_input = True

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        errors = error_count(n, self.kind)
        return blocks.pd(broadcast_gains(self.stiffness, errors), broadcast_gains(self.damping, errors))


class Pid(LinearBlock, heading="controllers"):
    """y = -stiffness e - integral int e dt - damping w; inputs are the errors e, then as many rates w."""

    kind: Literal["pid"] = "pid"
    """Selects this controller: proportional, integral and derivative."""
    stiffness: Gains
    """Gain on each error."""
    integral: Gains
    """Gain on the integral of each error."""
    damping: Gains
    """Gain on each rate."""

    per_input = True

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        errors = error_count(n, self.kind)
        return blocks.pid(*(broadcast_gains(gains, errors) for gains in (self.stiffness, self.integral, self.damping)))


class LowPass(LinearBlock, heading="controllers"):
    """A low-pass filter of every input."""

    kind: Literal["low_pass"] = "low_pass"
    """Selects this controller: a low-pass filter."""
    frequency: Annotated[float, Quantity("Hz", above=0.0)]
    """Corner frequency."""
    order: Annotated[int, Count(1, 2)] = 1
    """Order of the filter."""
    damping: Positive = 0.7071067811865476
    """Damping ratio of a filter of order 2."""

    per_input = True

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        return blocks.low_pass(self.frequency, self.order, self.damping, n)


class Notch(LinearBlock, heading="controllers"):
    """A notch filter of every input: (s^2 + 2 depth width w s + w^2) / (s^2 + 2 width w s + w^2)."""

    kind: Literal["notch"] = "notch"
    """Selects this controller: a notch filter."""
    frequency: Annotated[float, Quantity("Hz", above=0.0)]
    """Frequency that is left out."""
    width: Positive = 1.0
    """Damping ratio of the denominator."""
    depth: Annotated[float, Quantity(least=0.0, below=1.0)] = 0.0
    """Gain at the frequency."""

    per_input = True

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        return blocks.notch(self.frequency, self.width, self.depth, n)


class LinearSystem(LinearBlock, heading="controllers"):
    """dx/dt = A x + B u, y = C x + D u."""

    kind: Literal["state_space"] = "state_space"
    """Selects this controller: a linear system."""
    A: MatrixRows
    """System matrix."""
    B: MatrixRows
    """Input matrix."""
    C: MatrixRows
    """Output matrix."""
    D: MatrixRows | None = None
    """Feedthrough matrix. Default: zero."""

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        D = self.D if self.D is not None else np.zeros((len(self.C), len(self.B[0])))
        return blocks.state_space(self.A, self.B, self.C, D)


class Observer(LinearBlock, heading="controllers"):
    """State feedback over an observer: dx/dt = A x + B v + correction (y - C x), v = -feedback x."""

    kind: Literal["observer"] = "observer"
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

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        return blocks.observer(self.A, self.B, self.C, self.feedback, self.correction)


class Gain(LinearBlock, heading="controllers"):
    """y = matrix u."""

    kind: Literal["gain"] = "gain"
    """Selects this controller: a matrix."""
    matrix: MatrixRows
    """Gain matrix, one row per output."""

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        return blocks.gain(self.matrix)


class Allocation(LinearBlock, heading="controllers"):
    """Commands of least size with a demanded effect, by the pseudo-inverse of `effect`."""

    kind: Literal["allocation"] = "allocation"
    """Selects this controller: shares demands among actuators."""
    effect: MatrixRows
    """Effect of a unit of each command (columns) on each demand (rows); of a wheel's torque minus its axis."""

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        return blocks.allocation(self.effect)


class MomentumManagement(LinearBlock, heading="controllers"):
    """Torque demand -rate H for the momentum H = effect h of wheels; inputs are the h."""

    kind: Literal["momentum"] = "momentum"
    """Selects this controller: unloads wheels."""
    rate: Annotated[float, Quantity("1/s", above=0.0)]
    """Rate at which momentum is to fall."""
    effect: MatrixRows
    """Axes of the wheels as columns."""

    def system(self, n: int) -> StateSpace:
        """Its matrices for n inputs. Raises ValueError."""
        return blocks.momentum_management(self.rate, self.effect)


class AttitudeFeedback(Block, heading="controllers"):
    """Quaternion feedback: torque -stiffness e - damping omega + omega x (inertia omega + H)."""

    kind: Literal["attitude"] = "attitude"
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

    def controller(self, name: str, context: Context) -> Effector | Controller:
        """The feedback between its two sensors. Raises ValueError for signals that are none of these."""
        for key, kind in (("error", "attitude"), ("rate", "rate")):
            source = getattr(self, key)
            sensor = context.nouns.get(source.partition(".")[0])
            if isinstance(sensor, Sensor) and sensor.kind != kind:
                raise ValueError(
                    f"found {key} = {source!r}, a sensor of kind {sensor.kind!r}; give one of kind {kind!r}"
                )
        return blocks.attitude_feedback(
            name,
            signals_of([self.error], context),
            signals_of([self.rate], context),
            broadcast_gains(self.stiffness, 3),
            broadcast_gains(self.damping, 3),
            inertia=None if self.inertia is None else np.array(self.inertia),
            momentum=signals_of(self.momentum or [], context),
            limit=UNLIMITED if self.limit is None else self.limit,
            period=self.period,
        )

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Names of its outputs."""
        return list(self.outputs or "xyz")


class Pulses(EffectorNoun, heading="controllers"):
    """On-off commands whose mean over each period is demand / full."""

    n_markers = 0
    label = "controller"
    gives_signals = True

    kind: Literal["pulses"] = "pulses"
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
    def _pulse_is_shorter_than_period(self) -> Pulses:
        if self.minimum_on >= self.period:
            refuse(f"found minimum_on {self.minimum_on:g} s, and a period of {self.period:g} s; it must be shorter")
        return self

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """The controller of that name. Raises ValueError for counts that do not fit."""
        inputs = signals_of(self.inputs, context)
        full = broadcast_gains(self.full, len(inputs))
        return (blocks.pulses(name, inputs, self.outputs, full, self.period, self.minimum_on),)

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Names of its commands."""
        return list(self.outputs)


def error_count(n: int, kind: str) -> int:
    """The number of errors among n inputs; the other inputs are their rates. Raises ValueError for an odd n."""
    if n % 2:
        raise ValueError(f"kind {kind!r} takes errors, then as many rates; found {n} inputs. Give an even number.")
    return n // 2


def broadcast_gains(gains: tuple[float, ...], n: int) -> Array:
    """Gains (n,): one number is used for all channels. Raises ValueError unless there are 1 or n of them."""
    if len(gains) not in (1, n):
        raise ValueError(f"found {len(gains)} numbers where {n} channels are; give one, or one for each")
    return np.broadcast_to(np.array(gains, float), (n,))


def default_outputs(n: int) -> list[str]:
    """Names of n outputs."""
    return ["y"] if n == 1 else list("xyz") if n == 3 else [f"y{k + 1}" for k in range(n)]


def signals_of(names: Sequence[str], context: Context, path: tuple[str, ...] = ()) -> list[str]:
    """The signals of these names; the name of a sensor, controller or signal stands for all of its outputs.

    path: controllers whose number of outputs depends on these signals. Raises ValueError for an unknown name.
    """
    out = []
    for name in names:
        if "." in name:
            out.append(name)
            continue
        noun = context.nouns.get(name)
        outputs = [] if noun is None else noun.signals(name, context, path)
        if not outputs:
            sources = [key for key, other in context.nouns.items() if other.gives_signals]
            raise ValueError(
                f"found {name!r}, which is no sensor, controller or signal; {suggestion_text(name, sources)}"
            )
        out += [f"{name}.{output}" for output in outputs]
    return out
