"""[wheels.<name>] and [gyros.<name>]: balanced wheels and control-moment gyros."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import model_validator

from femflex.case.joint_values import Damper
from femflex.case.motion import Motion, MotionOf
from femflex.noun.table import Table, refuse
from femflex.noun.values import Count, Direction, Mass, Plain, Quantity, Rate, _Readable, counted_noun

Inertia = Annotated[float, Quantity("kg m^2", above=0.0)]
PositiveRate = Annotated[float, Quantity("rad/s", above=0.0)]
PositiveTorque = Annotated[float, Quantity("N m", above=0.0)]
Bandwidth = Annotated[float, Quantity("1/s", above=0.0)]


class MountedTable(Table):
    """An element at a marker of a body."""

    body: str
    """Body that carries it."""
    marker: str = "origin"
    """Marker at which it acts; directions are in the axes of this marker."""


class WheelTable(MountedTable):
    """A balanced reaction or momentum wheel: one state, its absolute axial momentum."""

    axis: Direction = (0.0, 0.0, 1.0)
    """Axis of the wheel, in the marker's axes."""
    inertia: Inertia
    """Axial moment of inertia of the rotor."""
    inertia_in_body: Literal["contained", "added"]
    """contained: mass and inertia of the body hold the wheel already; its axial inertia is taken out of the body, for
    the wheel turns by itself. added: `mass` and `transverse_inertia` are added to the body at the marker. `run` prints
    what was done."""
    mass: Mass | None = None
    """Mass of the wheel, with inertia_in_body = "added"."""
    transverse_inertia: Inertia | None = None
    """Moment of inertia of the rotor across its axis, with inertia_in_body = "added"."""
    torque: Annotated[float, Quantity("N m")] | None = None
    """Constant torque of the motor on the rotor. Default, without speed and command: none."""
    speed: Rate | None = None
    """Commanded speed relative to the body, in place of a torque."""
    command: str | None = None
    """Signal that commands the wheel, such as "law.x", in place of a constant."""
    commanded: Literal["torque", "speed"] = "torque"
    """Quantity that `command` gives: torque of the motor [N m] or speed [rad/s]."""
    bandwidth: Bandwidth = 10.0
    """Bandwidth of the servo that follows a commanded speed."""
    initial_speed: Rate = 0.0
    """Speed relative to the body at t = 0."""
    max_torque: PositiveTorque | None = None
    """Largest torque of the motor. Default: none."""
    max_speed: PositiveRate | None = None
    """Largest speed; over its last 1 % the torque that still accelerates goes to zero. Default: none."""
    viscous: Annotated[float, Quantity("N m s/rad", least=0.0)] = 0.0
    """Viscous friction of the bearing."""
    coulomb: Annotated[float, Quantity("N m", least=0.0)] = 0.0
    """Coulomb friction of the bearing, smoothed over `coulomb_speed`."""
    coulomb_speed: PositiveRate = 0.1
    """Speed scale of the smoothing: friction is coulomb tanh(speed / coulomb_speed)."""

    @model_validator(mode="after")
    def _keys_fit(self) -> WheelTable:
        commands = [key for key in ("torque", "speed", "command") if getattr(self, key) is not None]
        if len(commands) > 1:
            refuse(f"found {' and '.join(commands)} together; give one of them")
        rotor_keys = [key for key in ("mass", "transverse_inertia") if getattr(self, key) is not None]
        if self.inertia_in_body == "added" and len(rotor_keys) < 2:
            refuse('found inertia_in_body = "added" without mass and transverse_inertia; give both')
        if self.inertia_in_body == "contained" and rotor_keys:
            refuse(f'found {rotor_keys[0]} with inertia_in_body = "contained"; the body holds it already, so drop it')
        if self.max_speed is not None and abs(self.initial_speed) > self.max_speed:
            refuse(f"found initial_speed {self.initial_speed:g} rad/s beyond max_speed {self.max_speed:g} rad/s")
        return self


NUMBER_START, SIGNAL = re.compile(r"\s*[-+]?\.?\d"), re.compile(r"[\w-]+\.[A-Za-z_]\w*")


class _NumberOrSignal(_Readable):
    """A number with that unit, or the name of a signal."""

    def __init__(self, unit: str) -> None:
        self.number = Quantity(unit)

    def read_value(self, value: Any) -> float | str:
        """The number in SI, or the name: a text that does not begin with a number, or has the form of "2nd.value"."""
        if isinstance(value, str) and not (NUMBER_START.match(value) and not SIGNAL.fullmatch(value)):
            return value
        return float(self.number.read_value(value))

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both."""
        return {"anyOf": [self.number.json_schema(), {"type": "string", "description": "name of a signal"}]}


class GyroTable(MountedTable):
    """A control-moment gyro: a rotor of constant axial momentum in one or two gimbals."""

    momentum: Annotated[float, Quantity("N m s")]
    """Axial momentum of the rotor."""
    gimbal_axis: Direction = (0.0, 0.0, 1.0)
    """Axis of the (outer) gimbal, in the marker's axes."""
    spin_axis: Direction = (1.0, 0.0, 0.0)
    """Spin axis at gimbal angles of zero, in the marker's axes."""
    inner_axis: Direction | None = None
    """Axis of the inner gimbal at an outer angle of zero. Default: a single gimbal."""
    rates: list[Annotated[float | str, _NumberOrSignal("rad/s")]] | None = None
    """Commanded rate of each gimbal, outer first: a number, or the name of a signal."""
    angles: list[Annotated[float | str, _NumberOrSignal("rad")]] | None = None
    """Commanded angle of each gimbal, outer first, in place of rates: a number, or the name of a signal."""
    gain: Bandwidth = 1.0
    """Rate per angle error, where angles are commanded."""
    initial_angles: Annotated[tuple[float, ...] | None, Quantity("rad", (None,))] = None
    """Gimbal angles at t = 0. Default: zero."""
    max_rate: PositiveRate | None = None
    """Largest gimbal rate. Default: none."""
    gimbal_inertia: Annotated[float, Quantity("kg m^2", least=0.0)] = 0.0
    """Inertia of a single gimbal with its rotor about the gimbal axis, not part of the body's. Zero: gimbals follow
    their commands exactly."""
    bandwidth: Bandwidth = 10.0
    """Bandwidth of the gimbal's servo, with gimbal_inertia."""
    max_torque: PositiveTorque | None = None
    """Largest torque of the gimbal's motor, with gimbal_inertia. Default: none."""


class SeparationTable(MountedTable):
    """A spring between two markers that pushes while it is shorter than its free length, and never pulls."""

    parent: str
    """The other body."""
    parent_marker: str = "origin"
    """Marker of the other body."""
    stiffness: Annotated[float, Quantity("N/m", above=0.0)]
    """Stiffness of the spring."""
    length: Annotated[float, Quantity("m", above=0.0)]
    """Free length; beyond it the spring has let go."""


class CableTable(MountedTable):
    """A cable without mass between two markers: it pulls while they are farther apart than its length, else it is
    slack."""

    parent: str
    """The other body."""
    parent_marker: str = "origin"
    """Marker of the other body."""
    length: Annotated[Motion, MotionOf("m")]
    """Length that is let out: a value, or a profile over time such as { kind = "smooth_step", from = "5 m", to =
    "33 m", start = 0, end = "500 s" }. It must stay above zero."""
    EA: Annotated[float, Quantity("N", above=0.0)]
    """Axial stiffness, force per strain."""
    damping: Damper = 0.0
    """Damping while it is taut; it never makes the cable push."""
    mass_per_length: Annotated[float | None, Quantity("kg/m", above=0.0)] = None
    """Mass per length of a cable of constant length, as point masses on a line. Default: no mass."""
    masses: Annotated[int, Count(1, 500)] = 20
    """Number of point masses, with mass_per_length. They start on the straight line between the markers."""


class SignalTable(Table):
    """A number over time that effectors and controllers take as an input, as "<name>.value"."""

    times: Annotated[tuple[float, ...], Quantity("s", (None,))]
    """Times, rising. Before the first and after the last the value stays."""
    values: tuple[Plain, ...]
    """Value at each time, in SI units."""
    kind: Literal["steps", "linear", "smooth"] = "linear"
    """Between two times: stays, is linear, or goes from rest to rest as a polynomial of degree 5."""
    unit: str = "1"
    """Unit that the result file states."""

    @model_validator(mode="after")
    def _times_and_values_match(self) -> SignalTable:
        if len(self.times) != len(self.values):
            times, values = (
                counted_noun(len(self.times), "time", "times"),
                counted_noun(len(self.values), "value", "values"),
            )
            refuse(f"found {times} and {values}; give as many of both")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            refuse(f"found times {list(self.times)}; they must rise")
        return self
