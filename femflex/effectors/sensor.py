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
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.body.strain_field import StrainPart
from femflex.effectors.measure import measure
from femflex.effectors.noun import unit_direction
from femflex.summary import Rows, Summarised
from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.evaluation import CHANNEL_FOLDER

Kind = Literal["attitude", "rate", "displacement", "velocity", "acceleration", "pointing", "joint", "value"]

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


@dataclass(frozen=True, eq=False, repr=False)
class Sensor(Summarised):
    """A sensor at a marker, of a joint, or of a signal.

    kind          attitude: error against `reference`, 2 sign(q_0) (q_1, q_2, q_3) in marker axes, the rotation vector
                  where it is small; rate: inertial rate in marker axes; displacement and velocity: of the marker from
                  `other`, in its axes (inertial without one), displacement less `offset`; acceleration: inertial, in
                  marker axes, behind a lag of `bandwidth` [rad/s]; pointing: angle between `axis` of the marker and the
                  inertial direction `aim`, or the marker `other`; joint: coordinate and rate of a slide or turn
                  `freedom`; value: a `signal` such as "wheel.speed"
    reference     C_NR (3, 3): axes of the reference in inertial ones, or in those of `other`
    turning       (axis in the reference, signal of the angle): turns the reference, as for a slew
    bias          (3,) or one number
    sampling      None: continuous and exact but for the bias
    """

    name: str
    kind: Kind
    body: str = ""
    marker: str = "origin"
    other: tuple[str, str] | None = None
    reference: Array = field(default_factory=lambda: np.eye(3))
    turning: tuple[tuple[float, float, float], str] | None = None
    offset: Array = field(default_factory=lambda: np.zeros(3))
    bandwidth: float = 0.0
    axis: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    aim: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    freedom: str = ""
    signal: str = ""
    bias: Array = field(default_factory=lambda: np.zeros(3))
    sampling: Sampling | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise ValueError(f"sensor {self.name!r} has the kind {self.kind!r}; known are {', '.join(get_args(Kind))}")
        if self.kind == "acceleration" and not self.bandwidth > 0.0:
            raise ValueError(f"sensor {self.name!r} measures acceleration; give its bandwidth in rad/s")
        for key, kind in (("freedom", "joint"), ("signal", "value")):
            if self.kind == kind and not getattr(self, key):
                raise ValueError(f"sensor {self.name!r} of kind {kind!r} needs a {key}")
        object.__setattr__(self, "bias", np.broadcast_to(np.asarray(self.bias, float), (3,)).copy())
        if self.sampling is not None:
            check_sampling(self.name, self.sampling)

    def summary(self) -> tuple[str, Rows]:
        """Return a text: its marker, the quantity that it measures, and its sampling."""
        position = self.freedom or self.signal or f"{self.body}.{self.marker}"
        rows = [("measures", self.kind), ("at", position)]
        rows += [("outputs", ", ".join(f"{name} [{unit}]" for name, unit in self.outputs.items()))]
        rows += [("bias", ", ".join(f"{x:.6g}" for x in self.bias))] if self.bias.any() else []
        rows += [] if self.sampling is None else [("period", f"{self.sampling.period:g} s")]
        return f"Sensor {self.name!r}", rows

    @property
    def outputs(self) -> dict[str, str]:
        """Return name -> unit of its measurements."""
        if self.kind in UNITS:
            return dict.fromkeys(XYZ, UNITS[self.kind])
        if self.kind == "joint":
            return {"coordinate": "rad, m", "rate": "rad/s, m/s"}
        return {"angle": "rad"} if self.kind == "pointing" else {"value": "1"}

    @property
    def effectors(self) -> tuple[Effector | Controller, ...]:
        """Return the effectors of a System that model the sensor."""
        if self.sampling is None:
            return (self._exact(self.name, self.bias),)
        exact = self._exact(f"{self.name}_exact", np.zeros(3))
        paths = tuple(f"{CHANNEL_FOLDER}{exact.name}/{output}" for output in self.outputs)
        return exact, sampled_sensor(self.name, paths, self.outputs, self.bias[: len(paths)], self.sampling)

    def _exact(self, name: str, bias: Array) -> Effector:
        kind = float(get_args(Kind).index(self.kind))
        markers = (
            ()
            if self.kind in ("joint", "value")
            else ((self.body, self.marker), *(() if self.other is None else (self.other,)))
        )
        inputs: tuple[str, ...] = (self.signal,) if self.kind == "value" else ()
        numbers = np.zeros(0)
        if self.kind == "attitude":
            axis = np.zeros(3) if self.turning is None else unit_direction(name, "axis", self.turning[0])
            numbers = np.concatenate(
                [np.asarray(self.reference, float).ravel(), [float(self.turning is not None)], axis]
            )
            inputs = () if self.turning is None else (self.turning[1],)
        elif self.kind == "displacement":
            numbers = np.asarray(self.offset, float)
        elif self.kind == "acceleration":
            numbers = np.array([self.bandwidth])
        elif self.kind == "pointing":
            numbers = np.concatenate([unit_direction(name, "axis", self.axis), unit_direction(name, "aim", self.aim)])
        lagged = self.kind == "acceleration"
        return Effector(
            name,
            measure,
            markers,
            freedoms=(self.freedom,) if self.kind == "joint" else (),
            states={f"lagged_{axis}": "m/s" for axis in XYZ} if lagged else {},
            inputs=inputs,
            channels=self.outputs,
            exerts=(),
            starts={axis: (f"lagged_{axis}", float(b)) for axis, b in zip(XYZ, bias, strict=True)} if lagged else {},
            parameters=np.concatenate([[kind, float(len(markers))], bias, numbers]),
            kind="sensor",
            conserves=True,
        )


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
