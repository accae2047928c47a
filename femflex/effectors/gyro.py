"""Control-moment gyros: a rotor of constant axial momentum h in one or two gimbals that follow commands.

The rotor's axis s turns with its gimbals at omega_s = omega + sum g_k dgamma_k. The rotor receives h omega_s x s, and
gives it back. Gimbals without inertia follow their rates exactly; the motor of gimbal k then gives
g_k . (omega_s x h s), less its reaction. A single gimbal with inertia J_g about its axis has the momentum
p = J_g (dgamma + g.omega) as a state, and a motor that follows the commanded rate:

    dp/dt = motor - g.(omega x h s),    torque on the carrier  -motor g - [omega_s x h s] across g - omega x (p g)

A free gimbal has a spring and a damper in place of the motor: motor = -k gamma - c dgamma. On a body that turns slowly
at Omega across spin and gimbal axis it settles at k gamma = h Omega cos(gamma): a rate gyro.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import StrictBool, model_validator
from scipy.spatial.transform import Rotation

from femflex.arrays import Array
from femflex.effectors.noun import Mounted, NumberOrSignal, unit_direction
from femflex.effectors.wheel import MOMENTUM, Bandwidth, PositiveRate, PositiveTorque, Rotor, limited
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Vector, add, cross, dot, load3, load9, scale, store3, sub, turn
from femflex.noun.table import refuse
from femflex.noun.values import Direction, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

PERPENDICULAR = 1e-9  # product of unit vectors along two axes


class Gyro(Mounted, heading="gyros"):
    """A control-moment gyro: a rotor of constant axial momentum in one or two gimbals.

    Channels: momentum_x, _y, _z, and of each gimbal its rate and the torque of its motor.
    """

    momentum: Annotated[float, Quantity("N m s")]
    """Axial momentum of the rotor."""
    gimbal_axis: Direction = (0.0, 0.0, 1.0)
    """Axis of the (outer) gimbal, in the marker's axes."""
    spin_axis: Direction = (1.0, 0.0, 0.0)
    """Spin axis at gimbal angles of zero, in the marker's axes."""
    inner_axis: Direction | None = None
    """Axis of the inner gimbal at an outer angle of zero. Default: a single gimbal."""
    rates: list[Annotated[float | str, NumberOrSignal("rad/s")]] | None = None
    """Commanded rate of each gimbal, outer first: a number, or the name of a signal."""
    angles: list[Annotated[float | str, NumberOrSignal("rad")]] | None = None
    """Commanded angle of each gimbal, outer first, in place of rates: a number, or the name of a signal."""
    free: StrictBool = False
    """The single gimbal turns freely, against its spring and damper alone, in place of rates; needs gimbal_inertia."""
    stiffness: Annotated[float, Quantity("N m/rad", least=0.0)] = 0.0
    """Stiffness of the spring about a free gimbal's axis, which is relaxed at an angle of zero."""
    damping: Annotated[float, Quantity("N m s/rad", least=0.0)] = 0.0
    """Damping about a free gimbal's axis."""
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

    exerts = ("torque",)
    derived = ("gimbals", "takes_signal1", "command1", "takes_signal2", "command2", "follows_angles", "is_free")

    @model_validator(mode="after")
    def _keys_fit(self) -> Gyro:
        modes = [key for key in ("rates", "angles", "free") if getattr(self, key)]
        if len(modes) != 1:
            refuse(f"found {' and '.join(modes) or 'none of rates, angles and free'}; give one of them")
        if self.free and not self.gimbal_inertia:
            refuse("found free without gimbal_inertia; give it, for a free gimbal turns by its inertia")
        if not self.free and (self.stiffness or self.damping):
            refuse("found stiffness or damping of a gimbal that is not free; give free = true, or drop them")
        if self.gimbal_inertia and self.inner_axis is not None:
            refuse("found gimbal_inertia with two gimbals; it belongs to a single gimbal, for two follow exactly")
        initial = self.n_gimbals if self.initial_angles is None else len(self.initial_angles)
        if (len(self.commands) != self.n_gimbals and not self.free) or initial != self.n_gimbals:
            refuse(
                f"a gyro of {self.n_gimbals} gimbals has as many commands and initial angles; found "
                f"{len(self.commands)} and {initial}"
            )
        return self

    @property
    def n_gimbals(self) -> int:
        """Number of its gimbals."""
        return 1 if self.inner_axis is None else 2

    @property
    def commands(self) -> list[float | str]:
        """Commands of the gimbals: numbers, or names of signals."""
        return self.rates or self.angles or []

    def _axes(self, name: str) -> tuple[Array, Array, Array]:
        """Unit vectors of the gimbals and of the spin. Raises ValueError for axes that are not perpendicular."""
        g, s = (unit_direction(name, key, getattr(self, key)) for key in ("gimbal_axis", "spin_axis"))
        inner_axis = np.zeros(3)
        pairs = [("gimbal_axis", g, "spin_axis", s)]
        if self.inner_axis is not None:
            inner_axis = unit_direction(name, "inner_axis", self.inner_axis)
            pairs = [("inner_axis", inner_axis, "spin_axis", s), ("inner_axis", inner_axis, "gimbal_axis", g)]
        for first, a, second, b in pairs:
            if abs(a @ b) > PERPENDICULAR:
                raise ValueError(
                    f"{first} and {second} of {name!r} are not perpendicular: their product is {a @ b:.3g}"
                )
        return g, inner_axis, s

    def numbers(self) -> dict[str, ArrayLike]:
        """Its fields, with unit vectors as axes, and what commands its gimbals."""
        axes = dict(zip(("gimbal_axis", "inner_axis", "spin_axis"), self._axes(self.label), strict=True))
        commands = dict.fromkeys(("takes_signal1", "command1", "takes_signal2", "command2"), 0.0)
        out = super().numbers() | axes | commands | {"gimbals": float(self.n_gimbals), "is_free": float(self.free)}
        for k, command in enumerate(self.commands, start=1):
            is_signal = isinstance(command, str)
            out |= {f"takes_signal{k}": float(is_signal), f"command{k}": 0.0 if is_signal else float(command)}
        return out | {"follows_angles": float(self.angles is not None)}

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for axes that do not fit."""
        self._axes(name)
        n, heavy = self.n_gimbals, bool(self.gimbal_inertia)
        states = {"angle" if n == 1 else f"angle{k + 1}": "rad" for k in range(n)}
        gimbal_channels = {
            f"{key}{k + 1}": unit for k in range(n) for key, unit in (("rate", "rad/s"), ("motor", "N m"))
        }
        initial = list(self.initial_angles or [0.0] * n)
        return replace(
            super().effector(name, context),
            states=states | ({"momentum": "N m s"} if heavy else {}),
            z0=np.array([*initial, *([0.0] if heavy else [])]),
            sizes=np.array([*[1.0] * n, *([self.gimbal_inertia] if heavy else [])]),
            inputs=tuple(command for command in self.commands if isinstance(command, str)),
            channels={**MOMENTUM, **gimbal_channels},
            starts={"rate1": ("momentum", 0.0)} if heavy else {},
            accounts=(*(("energy",) if heavy else ()), "dissipation" if self.free else "supplied"),
            coasting=None if self.free else self._coasting,
        )

    def _coasting(self, name: str, states: Array) -> Effector:
        """The gyro as a rotor of constant momentum that stays at its gimbal angles."""
        outer, inner_axis, spin = self._axes(name)
        turning = Rotation.from_rotvec(outer * states[0])
        spin = turning.apply(spin)
        if self.n_gimbals == 2:
            spin = Rotation.from_rotvec(turning.apply(inner_axis) * states[1]).apply(spin)
        axis = (float(spin[0]), float(spin[1]), float(spin[2]))
        return Rotor(body=self.body, marker=self.marker, axis=axis, momentum=self.momentum).effector(name)


P, IN, OUT = Gyro.places()


@inner
def rotated(v: Vector, axis: Vector, angle: float) -> Vector:
    """v turned about a unit vector."""
    c, s = math.cos(angle), math.sin(angle)
    return add(add(scale(c, v), scale(s, cross(axis, v))), scale((1.0 - c) * dot(axis, v), axis))


@inner
def commanded_rate(command: float, angle: float, p: Array) -> float:
    """Rate that a command asks of a gimbal at that angle, within its limit."""
    if p[P.follows_angles] > 0.0:
        command = p[P.gain] * (command - angle)
    return limited(command, p[P.max_rate])


@Gyro.kernel
def gyro(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Channels: momentum (3), then rate and motor torque of each gimbal. States: angles, then p where it has one."""
    p, h = parameters, parameters[P.momentum]
    n, heavy = int(p[P.gimbals]), p[P.gimbal_inertia] > 0.0
    C, omega = load9(seen, IN.attitude), load3(seen, IN.rate)
    outer = turn(C, load3(p, P.gimbal_axis))
    inner_axis, spin = turn(C, load3(p, P.inner_axis)), turn(C, load3(p, P.spin_axis))
    input_index = IN.inputs
    command = p[P.command1]
    if p[P.takes_signal1] > 0.0:
        command = seen[input_index]
        input_index += 1
    first = commanded_rate(command, z[0], p)
    second, spin = 0.0, rotated(spin, outer, z[0])
    if n == 2:
        inner_axis = rotated(inner_axis, outer, z[0])
        spin = rotated(spin, inner_axis, z[1])
        command = seen[input_index] if p[P.takes_signal2] > 0.0 else p[P.command2]
        second = commanded_rate(command, z[1], p)
    n_z = n + 1 if heavy else n
    channel = 6 + n_z
    energy, dissipation = 0.0, 0.0
    if heavy:
        inertia, axial_momentum = p[P.gimbal_inertia], z[n]
        rate = axial_momentum / inertia - dot(outer, omega)
        reaction_torque = h * dot(outer, cross(omega, spin))
        motor = limited(inertia * p[P.bandwidth] * (first - rate) + reaction_torque, p[P.max_torque])
        if p[P.is_free] > 0.0:
            motor = -p[P.stiffness] * z[0] - p[P.damping] * rate
            dissipation = p[P.damping] * rate * rate
        reaction = scale(h, cross(add(omega, scale(rate, outer)), spin))
        transverse = sub(reaction, scale(dot(outer, reaction), outer))
        push = add(add(scale(motor, outer), transverse), scale(axial_momentum, cross(omega, outer)))
        out[6 + n] = motor - reaction_torque
        first, first_motor, second_motor = rate, motor, 0.0
        momentum = add(scale(h, spin), scale(axial_momentum, outer))
        energy = 0.5 * axial_momentum * axial_momentum / inertia + 0.5 * p[P.stiffness] * z[0] * z[0]
    else:
        turning = add(omega, add(scale(first, outer), scale(second, inner_axis)))
        push = scale(h, cross(turning, spin))
        first_motor, second_motor = dot(outer, push), dot(inner_axis, push) if n == 2 else 0.0
        momentum = scale(h, spin)
    store3(out, OUT.torque, scale(-1.0, push))
    out[6] = first
    store3(out, channel, momentum)
    out[channel + 3], out[channel + 4] = first, first_motor
    accounts = channel + 5
    if n == 2:
        out[7] = second
        out[channel + 5], out[channel + 6] = second, second_motor
        accounts = channel + 7
    out[accounts], out[accounts + 1] = energy, dissipation
    if p[P.is_free] == 0.0:
        out[accounts + 2] = first * first_motor + second * second_motor
