"""Reaction and momentum wheels: balanced ones as gyrostats (THEORY section 6a), unbalanced ones as bodies.

State: the absolute axial momentum h = J_s (Om + a.omega) of the rotor, omega the rate of its marker, a its axis there.

    dh/dt = tau,    torque on the carrier  -tau a - omega x (h a),    tau = motor - friction

with J_s a a^T taken out of the carrier's inertia. This is the form of section 6a with the term J_s a (a.domega/dt)
moved into h, so that no acceleration is needed. h a turns with the marker and what the carrier receives is minus its
rate of change: the total angular momentum is conserved to rounding. The energy is h^2 / (2 J_s) beyond that of the
carrier.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import model_validator

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker, rigid_body
from femflex.effectors.noun import Mounted, unit_direction
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import ZERO, cross, dot, load3, load9, scale, store3, sub, turn
from femflex.noun.table import refuse
from femflex.noun.values import Direction, Mass, Quantity, Rate
from femflex.system.acting import ALONE, Context
from femflex.system.attached import with_attached
from femflex.system.effector import Effector

Inertia = Annotated[float, Quantity("kg m^2", above=0.0)]
PositiveRate = Annotated[float, Quantity("rad/s", above=0.0)]
PositiveTorque = Annotated[float, Quantity("N m", above=0.0)]
Bandwidth = Annotated[float, Quantity("1/s", above=0.0)]

ROUNDED = 1e-3  # relative: digits of the inertias of a thin disc
TAPER = 0.01  # part of the largest speed over which the torque goes to zero
MOMENTUM = {f"momentum_{axis}": "N m s" for axis in "xyz"}


class Wheel(Mounted, heading="wheels"):
    """A balanced reaction or momentum wheel: one state, its absolute axial momentum.

    Channels: speed, motor (its torque), friction if it has any, saturated (1 while a limit acts) if it has a limit,
    momentum_x, _y, _z.
    """

    axis: Direction = (0.0, 0.0, 1.0)
    """Axis of the wheel, in the marker's axes."""
    inertia: Inertia
    """Axial moment of inertia of the rotor."""
    inertia_in_body: Literal["contained", "added", "separate"]
    """contained: mass and inertia of the body hold the wheel already; its axial inertia is taken out of the body, for
    the wheel turns by itself. added: `mass` and `transverse_inertia` are added to the body at the marker. separate: the
    body holds the wheel but for its axial inertia, and stays as it is. `run` prints what was done."""
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

    states = {"momentum": "N m s"}
    channels = {"speed": "rad/s", "motor": "N m", "friction": "N m", "saturated": "1", **MOMENTUM}
    accounts = ("energy", "dissipation", "supplied")
    exerts = ("torque",)
    writes_all = True
    derived = ("constant_command", "takes_signal", "follows_speed")

    @model_validator(mode="after")
    def _keys_fit(self) -> Wheel:
        commands = [key for key in ("torque", "speed", "command") if getattr(self, key) is not None]
        if len(commands) > 1:
            refuse(f"found {' and '.join(commands)} together; give one of them")
        rotor_keys = [key for key in ("mass", "transverse_inertia") if getattr(self, key) is not None]
        if self.inertia_in_body == "added" and len(rotor_keys) < 2:
            refuse('found inertia_in_body = "added" without mass and transverse_inertia; give both')
        if self.inertia_in_body != "added" and rotor_keys:
            refuse(
                f'found {rotor_keys[0]} with inertia_in_body = "{self.inertia_in_body}"; the body holds it already, '
                "so drop it"
            )
        if self.max_speed is not None and abs(self.initial_speed) > self.max_speed:
            refuse(f"found initial_speed {self.initial_speed:g} rad/s beyond max_speed {self.max_speed:g} rad/s")
        return self

    def numbers(self) -> dict[str, ArrayLike]:
        """Its fields, with a unit vector as axis, and what commands it."""
        follows_speed = self.speed is not None or (self.command is not None and self.commanded == "speed")
        return super().numbers() | {
            "axis": unit_direction(self.label, "axis", self.axis),
            "constant_command": self.speed if self.speed is not None else self.torque or 0.0,
            "takes_signal": float(self.command is not None),
            "follows_speed": float(follows_speed),
        }

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for an axis without direction."""
        rubs, limits = self.viscous + self.coulomb > 0.0, self.max_torque is not None or self.max_speed is not None
        return replace(
            super().effector(name, context),
            sizes=np.array([self.inertia * max(1.0, abs(self.initial_speed))]),
            accounts=tuple(account for account in self.accounts if rubs or account != "dissipation"),
            zeros=(*(() if rubs else ("friction",)), *(() if limits else ("saturated",))),
            inputs=() if self.command is None else (self.command,),
            starts={"speed": ("momentum", self.initial_speed)},
            coasting=self._coasting,
        )

    def _coasting(self, name: str, states: Array) -> Effector:
        rotor = Rotor(
            body=self.body,
            marker=self.marker,
            axis=tuple(unit_direction(name, "axis", self.axis)),
            momentum=float(states[0]),
        )
        return rotor.effector(name)

    def carrier(self, name: str, body: FlexibleBody) -> FlexibleBody:
        """The body less the axial inertia of a wheel that it contains, or with a wheel that is added to it.

        Raises ValueError where no positive inertia is left, and for a transverse inertia that no rotor has.
        """
        a = unit_direction(name, "axis", self.axis)
        if self.inertia_in_body == "separate":
            return body
        if self.inertia_in_body == "contained":
            return with_attached(body, self.marker, 0.0, -self.inertia * np.outer(a, a))
        mass, across = self.mass or 0.0, self.transverse_inertia or 0.0
        if across < self.inertia / 2.0 * (1.0 - ROUNDED):
            raise ValueError(
                f"wheel {name!r} has a transverse inertia of {across:g} kg m^2 and an axial one of {self.inertia:g} "
                "kg m^2; the axial inertia of a rotor is at most twice the transverse one, as of a thin disc"
            )
        return with_attached(body, self.marker, mass, across * (np.eye(3) - np.outer(a, a)))

    def note(self, name: str) -> str:
        """A sentence on the inertia that was taken out of the body, or added to it."""
        if self.inertia_in_body == "contained":
            return (
                f"Wheel {name} is contained in {self.body}: its axial inertia of {self.inertia:g} kg m^2 was taken out "
                "of the body's."
            )
        if self.inertia_in_body == "separate":
            return ""
        return (
            f"Wheel {name} was added to {self.body}: mass {self.mass:g} kg, transverse inertia "
            f"{self.transverse_inertia:g} kg m^2."
        )


P, IN, OUT = Wheel.places()


@inner
def limited(value: float, limit: float) -> float:
    """The value within -limit and limit."""
    return min(limit, max(-limit, value))


@Wheel.kernel
def wheel(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """A driven wheel."""
    p, J, h = parameters, parameters[P.inertia], z[0]
    axis, omega = turn(load9(seen, IN.attitude), load3(p, P.axis)), load3(seen, IN.rate)
    absolute = h / J
    speed = absolute - dot(axis, omega)
    command = seen[IN.inputs] if p[P.takes_signal] > 0.0 else p[P.constant_command]
    requested = command
    if p[P.follows_speed] > 0.0:
        requested = p[P.bandwidth] * J * (limited(command, p[P.max_speed]) - speed)
    motor = limited(requested, p[P.max_torque])
    if motor * speed > 0.0:  # the limit of speed: the last part of it takes the torque to zero
        motor *= limited(max(0.0, (p[P.max_speed] - abs(speed)) / (TAPER * p[P.max_speed])), 1.0)
    friction = p[P.viscous] * speed
    if p[P.coulomb] > 0.0:
        friction += p[P.coulomb] * math.tanh(speed / p[P.coulomb_speed])
    tau, momentum = motor - friction, scale(h, axis)
    store3(out, OUT.force, ZERO)
    store3(out, OUT.torque, sub(cross(momentum, omega), scale(tau, axis)))
    out[OUT.momentum] = tau
    out[OUT.speed], out[OUT.motor], out[OUT.friction] = speed, motor, friction
    out[OUT.saturated] = 1.0 if abs(motor - requested) > 1e-12 * abs(requested) else 0.0
    store3(out, OUT.momentum_x, momentum)
    out[OUT.energy], out[OUT.dissipation] = 0.5 * h * absolute, friction * speed
    out[OUT.supplied], out[OUT.mass_flow] = motor * speed, 0.0


class Rotor(Mounted):
    """A rotor of constant momentum that nothing drives: wheels and gyros in linear equations and equilibria."""

    axis: Direction
    """Spin axis, in the marker's axes."""
    momentum: Annotated[float, Quantity("N m s")]
    """Axial momentum."""

    channels = MOMENTUM
    exerts = ("torque",)


ROTOR, ROTOR_IN, ROTOR_OUT = Rotor.places()


@Rotor.kernel
def rotor(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """A wheel that nothing drives or brakes: h is a constant."""
    axis, omega = turn(load9(seen, ROTOR_IN.attitude), load3(parameters, ROTOR.axis)), load3(seen, ROTOR_IN.rate)
    momentum = scale(parameters[ROTOR.momentum], axis)
    store3(out, ROTOR_OUT.torque, cross(momentum, omega))
    store3(out, ROTOR_OUT.momentum_x, momentum)


def unbalanced_rotor(
    mass: float,
    axial_inertia: float,
    transverse_inertia: float,
    static_imbalance: float = 0.0,
    dynamic_imbalance: float = 0.0,
    markers: dict[str, Marker] | None = None,
) -> FlexibleBody:
    """A rotor that turns about its z axis through the origin, the middle of its bearing, with the given imbalances.

    static_imbalance   U_s [kg m]: the centre of mass lies at U_s / mass along x
    dynamic_imbalance  U_d [kg m^2]: the product of inertia int x z dm about the origin
    Raises ValueError for an inertia that no body has.
    """
    J = np.diag([transverse_inertia, transverse_inertia, axial_inertia])
    J[0, 2] = J[2, 0] = -dynamic_imbalance
    offset = np.array([static_imbalance / mass, 0.0, 0.0])
    about_centre = J - mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return rigid_body(mass, about_centre, offset, markers)
