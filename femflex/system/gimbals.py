"""Control-moment gyros: a rotor of constant axial momentum in one or two gimbals that follow commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from femflex.arrays import Array
from femflex.system.effector import Effector
from femflex.system.wheel import MOMENTUM, UNLIMITED, unit_direction


def control_moment_gyro(
    name: str,
    body: str,
    momentum: float,
    *,
    marker: str = "origin",
    gimbal_axis: ArrayLike = (0.0, 0.0, 1.0),
    spin_axis: ArrayLike = (1.0, 0.0, 0.0),
    inner_axis: ArrayLike | None = None,
    rates: Sequence[float | str] | None = None,
    angles: Sequence[float | str] | None = None,
    gain: float = 1.0,
    initial_angles: Sequence[float] = (),
    max_rate: float = UNLIMITED,
    gimbal_inertia: float = 0.0,
    bandwidth: float = 10.0,
    max_torque: float = UNLIMITED,
) -> Effector:
    """A rotor of momentum [N m s] along `spin_axis` in a gimbal about `gimbal_axis`, axes of a marker.

    inner_axis      of a second gimbal, carried by the first and perpendicular to the spin axis; None: a single gimbal
    rates           commanded rate of each gimbal [rad/s], a number or a signal; or
    angles          commanded angle of each [rad]: the rate is gain (angle - own angle), gain [1/s]
    initial_angles  at t = 0 [rad], 0 when left out: the axes are those at angle 0
    max_rate        [rad/s]
    gimbal_inertia  of a single gimbal with its rotor about the gimbal axis [kg m^2], not part of the body's; its motor
                    then follows the commanded rate with `bandwidth` [1/s] within `max_torque` [N m]. 0: gimbals follow
                    exactly, and the motor torques are results

    Channels: momentum_x, _y, _z, and of each gimbal rate and torque (of its motor).
    Raises ValueError for axes that do not fit.
    """
    g, s = unit_direction(name, "gimbal_axis", gimbal_axis), unit_direction(name, "spin_axis", spin_axis)
    n = 1 if inner_axis is None else 2
    inner = np.zeros(3) if inner_axis is None else unit_direction(name, "inner_axis", inner_axis)
    pairs = [("inner_axis", inner, "spin_axis", s), ("inner_axis", inner, "gimbal_axis", g)]
    for first, a, second, b in pairs if n == 2 else [("gimbal_axis", g, "spin_axis", s)]:
        if abs(a @ b) > 1e-9:
            raise ValueError(f"{first} and {second} of {name!r} are not perpendicular: their product is {a @ b:.3g}")
    if (rates is None) == (angles is None):
        raise ValueError(f"{name!r} needs commanded rates or commanded angles of its gimbals; give one of them")
    commands = list(rates if rates is not None else angles or ())
    initial = list(initial_angles) or [0.0] * n
    if len(commands) != n or len(initial) != n:
        raise ValueError(f"{name!r} has {n} gimbals; found {len(commands)} commands and {len(initial)} initial angles")
    if gimbal_inertia and n == 2:
        raise ValueError(f"gimbal_inertia of {name!r} belongs to a single gimbal; two gimbals follow exactly")
    if not (gimbal_inertia >= 0.0 and max_rate > 0.0 and max_torque > 0.0 and gain > 0.0 and bandwidth > 0.0):
        raise ValueError(f"gain, bandwidth and limits of {name!r} must be positive, gimbal_inertia not negative")
    numbers = [float(n), momentum, gimbal_inertia, bandwidth, *g, *inner, *s]
    for command in commands:
        is_signal = isinstance(command, str)
        entries = [
            float(is_signal),
            0.0 if is_signal else float(command),
            0.0 if angles is None else gain,
            max_rate,
            max_torque,
        ]
        numbers += entries
    states = {"angle" if n == 1 else f"angle{k + 1}": "rad" for k in range(n)}
    states |= {"momentum": "N m s"} if gimbal_inertia else {}
    own_channels = {f"{key}{k + 1}": unit for k in range(n) for key, unit in (("rate", "rad/s"), ("motor", "N m"))}
    return Effector(
        name,
        "gimbals",
        ((body, marker),),
        states=states,
        z0=np.array([*initial, *([0.0] if gimbal_inertia else [])]),
        sizes=np.array([*[1.0] * n, *([gimbal_inertia] if gimbal_inertia else [])]),
        inputs=tuple(command for command in commands if isinstance(command, str)),
        channels={**MOMENTUM, **own_channels},
        accounts=("energy", "supplied"),
        exerts=("torque",),
        parameters=np.array(numbers),
        starts={"rate1": ("momentum", 0.0)} if gimbal_inertia else {},
    )


def coasting_gyro(gyro: Effector, states: Array) -> Effector:
    """A gyro as a rotor of constant momentum that stays at its gimbal angles: for linear equations and equilibria."""
    p = gyro.parameters
    outer, inner, spin = p[4:7], p[7:10], p[10:13]
    turn = Rotation.from_rotvec(outer * states[0])
    spin = turn.apply(spin)
    if p[0] == 2.0:
        spin = Rotation.from_rotvec(turn.apply(inner) * states[1]).apply(spin)
    numbers = np.array([*spin, p[1]])
    return Effector(gyro.name, "rotor", gyro.markers, channels=MOMENTUM, exerts=("torque",), parameters=numbers)
