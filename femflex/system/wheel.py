"""Reaction and momentum wheels: balanced ones as gyrostats (THEORY section 6a), unbalanced ones as bodies.

A balanced wheel is one state, its absolute axial momentum h = J_s (Om + a.omega). Its axial inertia J_s must then not
be part of the carrier's own: `without_axial_inertia` takes it out of a body that contains it, `with_wheel` adds mass
and transverse inertia to one that does not.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker, rigid_body
from femflex.system.attached import with_attached
from femflex.system.effector import Effector

UNLIMITED = 1e300
ROUNDED = 1e-3  # relative: digits of the inertias of a thin disc
TAPER = 0.01  # part of the largest speed over which the torque goes to zero
MOMENTUM = {f"momentum_{axis}": "N m s" for axis in "xyz"}


def reaction_wheel(
    name: str,
    body: str,
    axial_inertia: float,
    *,
    marker: str = "origin",
    axis: ArrayLike = (0.0, 0.0, 1.0),
    torque: float | str = 0.0,
    speed: float | str | None = None,
    bandwidth: float = 10.0,
    initial_speed: float = 0.0,
    max_torque: float = UNLIMITED,
    max_speed: float = UNLIMITED,
    viscous: float = 0.0,
    coulomb: float = 0.0,
    coulomb_speed: float = 0.1,
) -> Effector:
    """A balanced wheel of axial inertia [kg m^2] about an axis of a marker.

    torque         of the motor on the rotor [N m]: a number, or the signal that commands it
    speed          commanded in place of the torque [rad/s]: the motor gives bandwidth J_s (speed - Om)
    bandwidth      of that servo [1/s]
    initial_speed  Om relative to the body at t = 0 [rad/s]
    max_torque, max_speed   limits; over the last 1 % of the speed the torque that still accelerates goes to zero
    viscous        friction [N m s];  coulomb  friction [N m], as tanh(Om / coulomb_speed)

    Channels: speed, motor, friction, saturated (1 while a limit acts), momentum_x, _y, _z.
    Raises ValueError for numbers that are not physical.
    """
    for what, value in (("axial_inertia", axial_inertia), ("max_torque", max_torque), ("max_speed", max_speed)):
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"{what} of wheel {name!r} is {value:g}; it must be positive")
    for what, value in (("viscous", viscous), ("coulomb", coulomb)):
        if not value >= 0.0:
            raise ValueError(f"{what} friction of wheel {name!r} is {value:g}; it must not be negative")
    if not (coulomb_speed > 0.0 and bandwidth > 0.0):
        raise ValueError(f"coulomb_speed and bandwidth of wheel {name!r} must be positive")
    if speed is not None and torque != 0.0:
        raise ValueError(f"wheel {name!r} has a commanded torque and a commanded speed; give one of them")
    if abs(initial_speed) > max_speed:
        raise ValueError(
            f"wheel {name!r} starts at {initial_speed:g} rad/s, and its largest speed is {max_speed:g} rad/s"
        )
    command = torque if speed is None else speed
    is_signal = isinstance(command, str)
    servo = 0.0 if speed is None else bandwidth
    numbers = [
        axial_inertia,
        float(is_signal),
        0.0 if is_signal else float(command),
        servo,
        max_torque,
        max_speed,
        TAPER,
    ]
    return Effector(
        name,
        "wheel",
        ((body, marker),),
        states={"momentum": "N m s"},
        sizes=np.array([axial_inertia * max(1.0, abs(initial_speed))]),
        inputs=(str(command),) if is_signal else (),
        channels={"speed": "rad/s", "motor": "N m", "friction": "N m", "saturated": "1", **MOMENTUM},
        accounts=("energy", "dissipation", "supplied"),
        exerts=("torque",),
        parameters=np.concatenate([unit_direction(name, "axis", axis), numbers, [viscous, coulomb, coulomb_speed]]),
        starts={"speed": ("momentum", initial_speed)},
    )


def coasting(wheel: Effector, momentum: float) -> Effector:
    """A wheel as a rotor of constant momentum [N m s] that nothing drives: for linear equations and equilibria."""
    numbers = np.concatenate([wheel.parameters[:3], [momentum]])
    return Effector(wheel.name, "rotor", wheel.markers, channels=MOMENTUM, exerts=("torque",), parameters=numbers)


def without_axial_inertia(body: FlexibleBody, wheel: Effector) -> FlexibleBody:
    """The carrier less the axial inertia of a wheel that its moments contain."""
    a, J = wheel.parameters[:3], wheel.parameters[3]
    return with_attached(body, wheel.markers[0][1], 0.0, -J * np.outer(a, a))


def with_wheel(body: FlexibleBody, wheel: Effector, mass: float, transverse_inertia: float) -> FlexibleBody:
    """The carrier with mass [kg] and transverse inertia [kg m^2] of a wheel that its moments do not contain.

    Raises ValueError for a transverse inertia below half the axial one, which no rotor has.
    """
    a, axial = wheel.parameters[:3], float(wheel.parameters[3])
    if transverse_inertia < axial / 2.0 * (1.0 - ROUNDED):
        raise ValueError(
            f"wheel {wheel.name!r} has a transverse inertia of {transverse_inertia:g} kg m^2 and an axial one of "
            f"{axial:g} kg m^2; the axial inertia of a rotor is at most twice the transverse one, as of a thin disc"
        )
    return with_attached(body, wheel.markers[0][1], mass, transverse_inertia * (np.eye(3) - np.outer(a, a)))


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


def unit_direction(name: str, what: str, vector: ArrayLike) -> Array:
    """The unit vector of a direction. Raises ValueError where it has none."""
    v = np.asarray(vector, float)
    length = float(np.linalg.norm(v))
    if v.shape != (3,) or not (math.isfinite(length) and length > 0.0):
        raise ValueError(f"{what} of {name!r} is {v.tolist()}; expected three numbers, not all zero")
    return v / length
