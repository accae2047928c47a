"""Sensors: measurements of the motion for controllers.

Without a period a sensor is exact and continuous, but for its bias: an effector without force. With a period it is
sampled: the exact measurement becomes an effector "<name>_exact", and the sensor a Controller whose commands are the
measured numbers, held between two samples. What it then measures at sample k is

    y_k = quantum round((x(t_k) + bias + noise n_k) / quantum),    known from t_k + delay on

n_k are standard normal numbers, a pure function of the seed, the sensor's name and k: a run repeats bit for bit, and
another sensor or another sample changes none of them. Before the first number arrives the first one is known.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.body.strain_field import StrainPart
from femflex.effectors.measure import measure
from femflex.effectors.noun import EffectorNoun, unit_direction
from femflex.effectors.wheel import PositiveRate
from femflex.noun.table import Orientation, refuse
from femflex.noun.values import Count, Direction, Duration, Position, Quantity, counted_noun
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.evaluation import CHANNEL_FOLDER
from femflex.system.segments import Part

Kind = Literal[
    "attitude", "rate", "displacement", "velocity", "acceleration", "pointing", "joint", "value", "strain", "vector"
]  # fmt: skip
KINDS = get_args(Kind)  # in the order in which femflex.effectors.measure numbers them

MAX_WAITING = 10_000  # samples on their way: each sample moves them all, in memory and in the result file
XYZ = ("x", "y", "z")
UNITS = {"attitude": "rad", "rate": "rad/s", "displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}


@dataclass(frozen=True, eq=False)
class Sampling:
    """Sampling of a sensor: period and delay [s], noise (standard deviation) and quantum in the sensor's unit."""

    period: float
    delay: float = 0.0
    noise: float = 0.0
    quantum: float = 0.0
    seed: int = 0


REQUIRED_KEY = {
    "joint": "coordinate",
    "value": "signal",
    "vector": "signal",
    "acceleration": "bandwidth",
    "strain": "component",
}
KINDS_WITH_KEY = {  # keys that belong to single kinds
    "reference": ("attitude",),
    "slew_axis": ("attitude",),
    "slew_angle": ("attitude",),
    "offset": ("displacement",),
    "bandwidth": ("acceleration",),
    "axis": ("pointing",),
    "aim": ("pointing",),
    "coordinate": ("joint",),
    "signal": ("value", "vector"),
    "point": ("strain",),
    "component": ("strain",),
    "other_body": ("attitude", "displacement", "velocity", "pointing"),
}


class Sensor(EffectorNoun, heading="sensors"):
    """A sensor: exact and continuous without a period, else sampled, late, biased, noisy and stepped as given.

    Its outputs are the signals x, y, z of attitude, rate, displacement, velocity, acceleration and vector; angle of
    pointing; coordinate and rate of joint; value of value; strain of strain.
    """

    kind: Kind
    """Measured quantity. attitude: error against the reference, the rotation vector where it is small. rate: inertial
    rate. displacement and velocity: from another marker. acceleration: behind a lag. pointing: angle of an axis to a
    direction. joint: coordinate and rate. value: a signal. strain: of a gauge. vector: of a surrounding, in the axes of
    the marker: a magnetometer measures the field, a sun sensor the direction to the sun."""
    body: str | None = None
    """Body that carries the sensor."""
    marker: str = "origin"
    """Marker of the sensor; measured vectors are in its axes."""
    other_body: str | None = None
    """Body from which displacement, velocity, attitude or direction count. Default: inertial axes."""
    other_marker: str = "origin"
    """Marker of that body."""
    reference: Orientation | None = None
    """Reference of an attitude, in inertial axes or those of the other marker. Default: these axes themselves."""
    slew_axis: Direction | None = None
    """Axis in the reference about which the reference turns, for a slew."""
    slew_angle: str | None = None
    """Signal of the angle [rad] by which the reference turns."""
    offset: Position = (0.0, 0.0, 0.0)
    """Displacement that counts as zero."""
    bandwidth: PositiveRate | None = None
    """Bandwidth of an accelerometer's first-order lag."""
    axis: Direction = (1.0, 0.0, 0.0)
    """Axis of the marker that points."""
    aim: Direction = (1.0, 0.0, 0.0)
    """Inertial direction to point at, without other_body."""
    coordinate: str | None = None
    """Slide or turn of a joint, such as "hinge.angle"."""
    signal: str | None = None
    """Signal to measure, such as "wheel.speed"; of a vector the name of a surrounding, such as "field"."""
    point: Position = (0.0, 0.0, 0.0)
    """Point of a strain gauge in the body frame. Beams: interpolated along the axis. Others: nearest strain point."""
    component: str | None = None
    """Component of a strain, such as "axial", "curvature_z" or "membrane_xx"."""
    bias: Annotated[tuple[float, ...] | None, Quantity("", (None,))] = None
    """Bias of each output, in SI units. Default: none."""
    period: Duration | None = None
    """Time between two samples. Default: continuous and exact."""
    delay: Annotated[float, Quantity("s", least=0.0)] = 0.0
    """Time from a sample to when its number is known."""
    noise: Annotated[float, Quantity(least=0.0)] = 0.0
    """Standard deviation of the noise of every sample, in SI units."""
    quantum: Annotated[float, Quantity(least=0.0)] = 0.0
    """Step of the measured numbers, in SI units. 0: none."""
    seed: Annotated[int, Count(0, 2**64 - 1)] = 0
    """Seed of the noise, which is a function of seed, sensor and number of the sample."""

    gives_signals = True

    @model_validator(mode="after")
    def _keys_fit_kind(self) -> Sensor:
        if self.kind not in ("joint", "value") and self.body is None:
            refuse(f"found no body for a sensor of kind {self.kind!r}; name the body that carries it")
        required = REQUIRED_KEY.get(self.kind)
        if required is not None and getattr(self, required) is None:
            refuse(f"found no {required} for a sensor of kind {self.kind!r}; give it")
        for key, kinds in KINDS_WITH_KEY.items():
            if key in self.model_fields_set and self.kind not in kinds:
                refuse(f"found {key} for a sensor of kind {self.kind!r}; it belongs to {' and '.join(kinds)}")
        if (self.slew_axis is None) != (self.slew_angle is None):
            refuse("found one of slew_axis and slew_angle; they belong together")
        sampled = [key for key in ("delay", "noise", "quantum") if getattr(self, key)]
        if self.period is None and (sampled or self.kind == "strain"):
            refuse(f"found {sampled[0] if sampled else 'a strain'} without period; give the time between two samples")
        outputs = 1 if self.kind in ("pointing", "value", "strain") else 2 if self.kind == "joint" else 3
        if self.bias is not None and len(self.bias) != outputs:
            numbers, outputs_text = (
                counted_noun(len(self.bias), "number", "numbers"),
                counted_noun(outputs, "output", "outputs"),
            )
            refuse(f"found {numbers} in bias; a sensor of kind {self.kind!r} has {outputs_text}")
        return self

    @property
    def outputs(self) -> dict[str, str]:
        """Name -> unit of its measurements."""
        if self.kind in UNITS or self.kind == "vector":
            return dict.fromkeys(XYZ, UNITS.get(self.kind, "1"))
        if self.kind == "joint":
            return {"coordinate": "rad, m", "rate": "rad/s, m/s"}
        if self.kind == "strain":
            return {"strain": "1/m" if str(self.component).startswith("curvature") else "1"}
        return {"angle": "rad"} if self.kind == "pointing" else {"value": "1"}

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Names of its measurements."""
        return list(self.outputs)

    def markers(self) -> tuple[tuple[str, str], ...]:
        """Its marker, and the one that it measures from."""
        if self.kind in ("joint", "value", "strain"):
            return ()
        other = () if self.other_body is None else ((self.other_body, self.other_marker),)
        return ((self.body or "", self.marker), *other)

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """The exact measurement, and the controller that samples it. Raises ValueError."""
        bias = np.zeros(len(self.outputs)) if self.bias is None else np.array(self.bias)
        if self.period is None:
            return (self._exact(name, np.pad(bias, (0, 3 - len(bias)))),)
        sampling = Sampling(self.period, self.delay, self.noise, self.quantum, self.seed)
        check_sampling(name, sampling)
        if self.kind == "strain":
            body = single_body(context.bodies[self.body or ""])
            point, component = np.array(self.point), str(self.component)
            return (strain_sensor(name, self.body or "", body, point, component, sampling, float(bias[0])),)
        exact = self._exact(f"{name}_exact", np.zeros(3))
        paths = tuple(f"{CHANNEL_FOLDER}{exact.name}/{output}" for output in self.outputs)
        return exact, sampled_sensor(name, paths, self.outputs, bias, sampling)

    def _exact(self, name: str, bias: Array) -> Effector:
        markers = self.markers()
        inputs: tuple[str, ...] = (self.signal,) if self.kind == "value" and self.signal else ()
        numbers = np.zeros(0)
        if self.kind == "vector":
            inputs = tuple(f"{self.signal}.{axis}" for axis in XYZ)
        if self.kind == "attitude":
            axis = np.zeros(3) if self.slew_axis is None else unit_direction(name, "axis", self.slew_axis)
            reference = np.eye(3) if self.reference is None else np.array(self.reference)
            numbers = np.concatenate([reference.ravel(), [float(self.slew_axis is not None)], axis])
            inputs = () if self.slew_angle is None else (self.slew_angle,)
        elif self.kind == "displacement":
            numbers = np.array(self.offset)
        elif self.kind == "acceleration":
            numbers = np.array([self.bandwidth])
        elif self.kind == "pointing":
            numbers = np.concatenate([unit_direction(name, "axis", self.axis), unit_direction(name, "aim", self.aim)])
        lagged = self.kind == "acceleration"
        return Effector(
            name,
            measure,
            markers,
            freedoms=(self.coordinate,) if self.kind == "joint" and self.coordinate else (),
            states={f"lagged_{axis}": "m/s" for axis in XYZ} if lagged else {},
            inputs=inputs,
            channels=self.outputs,
            exerts=(),
            starts={axis: (f"lagged_{axis}", float(b)) for axis, b in zip(XYZ, bias, strict=True)} if lagged else {},
            parameters=np.concatenate([[KINDS.index(self.kind), float(len(markers))], bias, numbers]),
            kind=self.label,
            conserves=True,
        )


def single_body(part: Part) -> FlexibleBody:
    """The part itself if it is a single body. Raises ValueError if it is cut into segments."""
    if not isinstance(part, FlexibleBody):
        raise ValueError(
            "found a strain sensor on a body cut into segments, whose strain is not known at one point of the whole; "
            "leave the segments out, or report the stress (`femflex stress`)"
        )
    return part


def strain_sensor(
    name: str, body_name: str, body: FlexibleBody, point: Array, component: str, sampling: Sampling, bias: float = 0.0
) -> Controller:
    """A sampled strain of a flexible body at a point (3,), body frame [m].

    Along a beam it is interpolated between two points of the strain field, elsewhere it is that of the nearest one (see
    `StrainPart.at`). component: a name of StrainPart.names, such as "axial" or "curvature_z". Raises ValueError where
    there is none.
    """
    parts = [part for part in body.strain_field if component in part.names]
    if not parts:
        gauge_names = sorted({n for part in body.strain_field for n in part.names})
        raise ValueError(
            f"sensor {name!r} measures the strain {component!r} of body {body_name!r}, which has "
            f"{', '.join(gauge_names) or 'no strain field'}"
        )
    point = np.asarray(point, float)
    part_at_point = min(
        (part.at_point(point) for part in parts), key=lambda part: float(np.linalg.norm(part.places[0] - point))
    )
    check_sampling(name, sampling)
    unit = "1/m" if component.startswith("curvature") else "1"
    strain_at = StrainAt(part_at_point, part_at_point.names.index(component), f"bodies/{body_name}/delta")
    return sampled_sensor(name, (strain_at.path,), {"strain": unit}, np.array([bias]), sampling, strain_at)


@dataclass(frozen=True, eq=False)
class StrainAt:
    """A strain from the amplitudes of the shapes; zero where the preliminary simulation made the body rigid."""

    part: StrainPart
    place: int
    path: str

    def __call__(self, sensors: Mapping[str, Array]) -> Array:
        y = sensors[self.path]
        return np.array([self.part.strains(y[None])[0, 0, self.place]]) if y.size else np.zeros(1)


def check_sampling(name: str, sampling: Sampling) -> None:
    """Raise ValueError for numbers of a sampling that are not physical."""
    for key in ("period", "delay", "noise", "quantum"):
        value = getattr(sampling, key)
        if not (math.isfinite(value) and (value > 0.0 if key == "period" else value >= 0.0)):
            raise ValueError(f"{key} of sensor {name!r} is {value:g}; it must be positive, or zero but for the period")
    if (waiting := sampling.delay / sampling.period) > MAX_WAITING:
        raise ValueError(
            f"delay of sensor {name!r} is {waiting:.3g} of its periods (limit {MAX_WAITING}, because every "
            "delayed sample is a state); shorten the delay or lengthen the period"
        )


def sampled_sensor(
    name: str,
    paths: tuple[str, ...],
    outputs: Mapping[str, str],
    bias: Array,
    sampling: Sampling,
    of: StrainAt | None = None,
) -> Controller:
    """Return the Controller that samples channels, or the quantity that `of` computes of them."""
    delay_samples = math.floor(sampling.delay / sampling.period + 1e-9)
    remainder = max(0.0, sampling.delay - delay_samples * sampling.period)
    remainder = 0.0 if remainder < 1e-9 * sampling.period else remainder
    n = len(outputs)
    law = _Sampled(name, paths, n, np.asarray(bias, float), sampling, delay_samples, remainder, of)
    return Controller(name, law, sampling.period, paths, dict(outputs), memory=np.zeros(2 + (delay_samples + 2) * n))


@dataclass(frozen=True, eq=False)
class _Sampled:
    """Law of a sampled sensor. Memory: number of samples, whether one waits, the last output, the last samples."""

    name: str
    paths: tuple[str, ...]
    n: int
    bias: Array
    sampling: Sampling
    late: int
    rest: float
    of: StrainAt | None

    def __call__(self, t: float, sensors: Mapping[str, Array], memory: Array) -> tuple[Array, Array, float | None]:
        k, waits = int(memory[0]), memory[1] > 0.0
        output, samples = memory[2 : 2 + self.n], memory[2 + self.n :].reshape(self.late + 1, self.n)
        if waits:  # the number that was on its way arrives
            output, waits = samples[0], False
        else:
            value = self._measured(k, sensors)
            samples = np.tile(value, (self.late + 1, 1)) if k == 0 else np.concatenate([samples[1:], value[None]])
            output, waits, k = (output if k else value) if self.rest else samples[0], self.rest > 0.0, k + 1
        memory = np.concatenate([[float(k), float(waits)], output, samples.ravel()])
        return output, memory, t + self.rest if waits else None

    def _measured(self, k: int, sensors: Mapping[str, Array]) -> Array:
        x = self.of(sensors) if self.of else np.array([float(sensors[path]) for path in self.paths])
        x = x + self.bias + self.sampling.noise * noise_numbers(self.sampling.seed, self.name, k, self.n)
        q = self.sampling.quantum
        return q * np.round(x / q) if q else x


def noise_numbers(seed: int, name: str, k: int, n: int) -> Array:
    """n standard normal numbers that depend on the seed, the sensor's name and the number k of the sample alone."""
    key = np.array([seed % 2**64, zlib.crc32(name.encode())], np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=np.array([0, 0, 0, k], np.uint64))).standard_normal(n)


def without_quantum(controller: Controller) -> Controller:
    """A sampled sensor whose numbers have no steps, which have no derivative; any other controller as it is."""
    if not isinstance(controller.law, _Sampled) or not controller.law.sampling.quantum:
        return controller
    return replace(controller, law=replace(controller.law, sampling=replace(controller.law.sampling, quantum=0.0)))
