"""Controllers: blocks that turn signals into commands, continuous or sampled.

A linear controller is dx/dt = A x + B u, y = C x + D u: an Effector that runs continuously, its x among the states of
the run, or with a period a Controller: sampled with its inputs held (exact discretisation, zero order hold), its
outputs held between two samples.

Controllers are joined by their signals: "<controller>.<output>". The order of evaluation is that of
femflex.system.evaluation; algebraic loops give an error.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, StrictBool, model_validator

from femflex.arrays import Array
from femflex.effectors import block_kernels
from femflex.effectors.control_laws import LinearLaw, PulseWidths, SampledAttitude, SampledLaw, discretised, paths_of
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


class _AxisGains(_Readable):
    """A number for three axes, a number for each, or a 3 x 3 matrix."""

    forms = (Quantity(), Quantity("", (3,)), Quantity("", (3, 3)))

    def read_value(self, value: object) -> object:
        """The numbers as they are given."""
        depth = 0 if not isinstance(value, list) else 2 if value and isinstance(value[0], list) else 1
        return self.forms[depth].read_value(value)

    def json_schema(self) -> dict[str, object]:
        """JSON Schema of the three forms."""
        return {"anyOf": [form.json_schema() for form in self.forms]}


AxisGains = Annotated[float | Numbers | Rows, _AxisGains()]


OneBlock = TypeVar("OneBlock", "Block", "Pulses")


def _axis_matrix(gains: ArrayLike) -> Array:
    array = np.asarray(gains, float)
    return array if array.ndim == 2 else np.diag(np.broadcast_to(array, (3,)))


def _refuse_repeated_outputs(noun: OneBlock) -> OneBlock:
    names = list(noun.outputs or ())
    if repeated := [name for k, name in enumerate(names) if name in names[:k]]:
        refuse(f"found {repeated[0]!r} twice among the outputs; give each output a name of its own")
    return noun


class Block(EffectorNoun):
    """Keys that all controllers share. Numbers are in SI units."""

    n_markers = 0
    label = "controller"
    gives_signals = True

    outputs: list[Name] | None = None
    """Names of the outputs. Default: x, y, z of three, y of one, else y1, y2 and so on."""
    period: Duration | None = None
    """Time between two samples; commands are held between them. Default: continuous."""

    _outputs_differ = model_validator(mode="after")(_refuse_repeated_outputs)

    @abstractmethod
    def controller(self, name: str, context: Context = ALONE) -> Effector | Controller:
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
    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""

    def controller(self, name: str, context: Context = ALONE) -> Effector | Controller:
        """The block with these matrices. Raises ValueError for counts and matrices that do not fit."""
        inputs = signals_of(self.inputs, context)
        law = self.system(len(inputs))
        n, (p, m) = len(law.A), law.D.shape
        limits = np.full(p, UNLIMITED) if self.limit is None else broadcast_gains(self.limit, p).copy()
        channels = dict.fromkeys(self.outputs or default_outputs(p), "1")
        if len(inputs) != m or len(channels) != p:
            raise ValueError(
                f"block {name!r} takes {m} inputs and gives {p} outputs; found {len(inputs)} inputs and "
                f"{len(channels)} outputs"
            )
        if self.period is not None:
            sampled = SampledLaw(discretised(law, self.period), limits, self.scaled, paths_of(inputs))
            return Controller(name, sampled, self.period, sampled.paths, channels, memory=np.zeros(n))

        def numbers(gain: float) -> Array:
            matrices = (law.A, law.B, gain * law.C, gain * law.D)
            return np.concatenate([[m, n, p, self.scaled], *(matrix.ravel() for matrix in matrices), limits])

        controller = Effector(
            name,
            block_kernels.state_space,
            states={f"x{k + 1}": "1" for k in range(n)},
            inputs=tuple(inputs),
            channels=channels,
            parameters=numbers(1.0),
            kind="controller",
        )
        return replace(controller, silent=partial(replace, controller, parameters=numbers(0.0)))

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

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        errors = error_count(n, self.kind)
        P, D = (np.diag(broadcast_gains(gains, errors)) for gains in (self.stiffness, self.damping))
        return LinearLaw.gain(-np.hstack([P, D]))


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

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        n = error_count(n, self.kind)
        P, I, D = (np.diag(broadcast_gains(gains, n)) for gains in (self.stiffness, self.integral, self.damping))
        return LinearLaw(np.zeros((n, n)), np.hstack([np.eye(n), np.zeros((n, n))]), -I, -np.hstack([P, D]))


class LowPass(LinearBlock, heading="controllers"):
    """A low-pass filter of every input: w / (s + w), or w^2 / (s^2 + 2 damping w s + w^2)."""

    kind: Literal["low_pass"] = "low_pass"
    """Selects this controller: a low-pass filter."""
    frequency: Annotated[float, Quantity("Hz", above=0.0)]
    """Corner frequency."""
    order: Annotated[int, Count(1, 2)] = 1
    """Order of the filter."""
    damping: Positive = 0.7071067811865476
    """Damping ratio of a filter of order 2."""

    per_input = True

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        w = 2.0 * math.pi * self.frequency
        if self.order == 1:
            return LinearLaw.from_matrices([[-w]], [[w]], [[1.0]], [[0.0]]).repeated(n)
        A = [[0.0, 1.0], [-w * w, -2.0 * self.damping * w]]
        return LinearLaw.from_matrices(A, [[0.0], [w * w]], [[1.0, 0.0]], [[0.0]]).repeated(n)


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

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        w = 2.0 * math.pi * self.frequency
        A, C = [[0.0, 1.0], [-w * w, -2.0 * self.width * w]], [[0.0, 2.0 * (self.depth - 1.0) * self.width * w]]
        return LinearLaw.from_matrices(A, [[0.0], [1.0]], C, [[1.0]]).repeated(n)


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

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        D = self.D if self.D is not None else np.zeros((len(self.C), len(self.B[0])))
        return LinearLaw.from_matrices(self.A, self.B, self.C, D)


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

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        A, B, C, K, L = map(np.array, (self.A, self.B, self.C, self.feedback, self.correction))
        n, n_v, n_y = len(A), len(K), len(C)
        shapes = {"A": (n, n), "B": (n, n_v), "C": (n_y, n), "feedback": (n_v, n), "correction": (n, n_y)}
        for (name, shape), matrix in zip(shapes.items(), (A, B, C, K, L), strict=True):
            if matrix.shape != shape:
                raise ValueError(
                    f"matrices of an observer do not fit: {name} has shape {matrix.shape}; with {n} states (rows of "
                    f"A), {n_y} inputs (rows of C) and {n_v} outputs (rows of feedback) it needs {shape}"
                )
        return LinearLaw(A - B @ K - L @ C, L, -K, np.zeros((n_v, n_y)))


class Gain(LinearBlock, heading="controllers"):
    """y = matrix u."""

    kind: Literal["gain"] = "gain"
    """Selects this controller: a matrix."""
    matrix: MatrixRows
    """Gain matrix, one row per output."""

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        return LinearLaw.gain(self.matrix)


class Allocation(LinearBlock, heading="controllers"):
    """Commands of least size with a demanded effect, by the pseudo-inverse of `effect`."""

    kind: Literal["allocation"] = "allocation"
    """Selects this controller: shares demands among actuators."""
    effect: MatrixRows
    """Effect of a unit of each command (columns) on each demand (rows); of a wheel's torque minus its axis."""

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        E = np.array(self.effect)
        if (rank := np.linalg.matrix_rank(E)) < len(E):
            raise ValueError(
                f"{E.shape[1]} actuators produce {rank} of {len(E)} demands independently; add actuators, or remove "
                "demands"
            )
        return LinearLaw.gain(np.linalg.pinv(E))


class MomentumManagement(LinearBlock, heading="controllers"):
    """Torque demand -rate H for the momentum H = effect h of wheels; inputs are the h."""

    kind: Literal["momentum"] = "momentum"
    """Selects this controller: unloads wheels."""
    rate: Annotated[float, Quantity("1/s", above=0.0)]
    """Rate at which momentum is to fall."""
    effect: MatrixRows
    """Axes of the wheels as columns."""

    def system(self, n: int) -> LinearLaw:
        """Its matrices for n inputs. Raises ValueError."""
        return LinearLaw.gain(-self.rate * np.array(self.effect))


class AttitudeFeedback(Block, heading="controllers"):
    """Quaternion feedback: torque -stiffness e - damping omega + omega x (inertia omega + H)."""

    kind: Literal["attitude"] = "attitude"
    """Selects this controller: quaternion feedback."""
    error: str
    """Attitude sensor."""
    rate: str
    """Rate sensor with the same axes."""
    stiffness: AxisGains
    """Gain on the error: one number, one per axis, or a matrix."""
    damping: AxisGains
    """Gain on the rate: one number, one per axis, or a matrix."""
    inertia: InertiaMatrix | None = None
    """Inertia of the gyroscopic torque that is compensated. Default: none."""
    momentum: list[str] | None = None
    """Signals of the momentum of wheels in the same axes. Default: none."""
    limit: Positive | None = None
    """Largest size of each component. Default: none."""

    def controller(self, name: str, context: Context = ALONE) -> Effector | Controller:
        """The feedback between its two sensors. Raises ValueError for signals that are none of these."""
        for key, kind in (("error", "attitude"), ("rate", "rate")):
            source = getattr(self, key)
            sensor = context.nouns.get(source.partition(".")[0])
            if isinstance(sensor, Sensor) and sensor.kind != kind:
                raise ValueError(
                    f"found {key} = {source!r}, a sensor of kind {sensor.kind!r}; give one of kind {kind!r}"
                )
        P, D = _axis_matrix(self.stiffness), _axis_matrix(self.damping)
        J = np.zeros((3, 3)) if self.inertia is None else np.array(self.inertia)
        limit = UNLIMITED if self.limit is None else self.limit
        error, rate, momentum = (
            signals_of(given, context) for given in ([self.error], [self.rate], self.momentum or [])
        )
        inputs = (*error, *rate, *momentum)
        if [len(error), len(rate)] != [3, 3] or len(momentum) not in (0, 3):
            raise ValueError(
                f"block {name!r} takes three errors, three rates and three momenta or none; found {list(inputs)}"
            )
        channels = dict.fromkeys(self.signals(name, context), "N m")
        if self.period is not None:
            law = SampledAttitude(P, D, J, limit, paths_of(inputs))
            return Controller(name, law, self.period, law.paths, channels)

        def numbers(gain: float) -> Array:
            return np.concatenate([[bool(momentum)], *(gain * matrix.ravel() for matrix in (P, D, J)), [limit]])

        controller = Effector(
            name,
            block_kernels.attitude_feedback,
            inputs=inputs,
            channels=channels,
            parameters=numbers(1.0),
            kind="controller",
        )
        return replace(controller, silent=partial(replace, controller, parameters=numbers(0.0)))

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Names of its outputs."""
        return list(self.outputs or "xyz")


class Pulses(EffectorNoun, heading="controllers"):
    """On-off commands, 0 or 1, whose mean over each period is demand / full: pulse-width modulation at exact instants.

    A demand drives the thruster of positive effect only: give each thruster a demand of its own, by an allocation.
    """

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

    _outputs_differ = model_validator(mode="after")(_refuse_repeated_outputs)

    @model_validator(mode="after")
    def _pulse_is_shorter_than_period(self) -> Pulses:
        if self.minimum_on >= self.period:
            refuse(f"found minimum_on {self.minimum_on:g} s, and a period of {self.period:g} s; it must be shorter")
        return self

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """The controller of that name. Raises ValueError for counts that do not fit."""
        inputs = signals_of(self.inputs, context)
        if len(inputs) != len(self.outputs):
            raise ValueError(
                f"{name!r} has {len(inputs)} demands and {len(self.outputs)} outputs; give as many of both"
            )
        full = broadcast_gains(self.full, len(inputs))
        law = PulseWidths(paths_of(inputs), full, self.period, self.minimum_on)
        memory = np.full(len(inputs) + 1, -1.0)
        return (Controller(name, law, self.period, law.paths, dict.fromkeys(self.outputs, "1"), memory=memory),)

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
