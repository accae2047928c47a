"""[sensors.<name>]: measurements for controllers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import model_validator

from femflex.effectors.wheel import PositiveRate
from femflex.noun.table import Orientation, Table, refuse
from femflex.noun.values import Count, Direction, Duration, Position, Quantity, counted_noun

REQUIRED_KEY = {"joint": "coordinate", "value": "signal", "acceleration": "bandwidth", "strain": "component"}
KINDS_WITH_KEY = {  # keys that belong to single kinds
    "reference": ("attitude",),
    "slew_axis": ("attitude",),
    "slew_angle": ("attitude",),
    "offset": ("displacement",),
    "bandwidth": ("acceleration",),
    "axis": ("pointing",),
    "aim": ("pointing",),
    "coordinate": ("joint",),
    "signal": ("value",),
    "point": ("strain",),
    "component": ("strain",),
    "other_body": ("attitude", "displacement", "velocity", "pointing"),
}


class SensorTable(Table):
    """A sensor: exact and continuous without a period, else sampled, late, biased, noisy and stepped as given.

    Its outputs are the signals x, y, z of attitude, rate, displacement, velocity and acceleration; angle of pointing;
    coordinate and rate of joint; value of value; strain of strain.
    """

    kind: Literal[
        "attitude", "rate", "displacement", "velocity", "acceleration", "pointing", "joint", "value", "strain"
    ]
    """Measured quantity. attitude: error against the reference, the rotation vector where it is small. rate: inertial
    rate. displacement and velocity: from another marker. acceleration: behind a lag. pointing: angle of an axis to a
    direction. joint: coordinate and rate. value: a signal. strain: of a gauge."""
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
    """Signal to measure, such as "wheel.speed"."""
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

    @model_validator(mode="after")
    def _keys_fit_kind(self) -> SensorTable:
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
