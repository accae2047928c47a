"""Thrusters at markers of any body.

A thruster pushes with F along d, fixed in its marker. Mass leaves at |mdot| = F / c (c the exit velocity). Where it
comes from a tank at another marker, it flows along a straight line from there to the nozzle:

    at the nozzle  F d - |mdot| w,      at the tank  - |mdot| w,  torque |mdot| k^2 omega_t,      w = v_e - v_t

where v_e and v_t are the velocities of nozzle and tank, and k^2 is the inertia of the propellant about its own centre
per mass. This is the balance of momentum and of angular momentum of craft, flow and exhaust together, with the momentum
|mdot| (e - t) of the flow: its Coriolis force -2 |mdot| omega x (e - t), and jet damping. Nothing of it depends on a
uniform translation. (In THEORY section 4, mdot (v_e + c) at the exit beside M_t u, mass leaves where it was stored; w
is zero then.) The momentum that the flow has is left out when it begins and ends.

The kinetic energy that the mass had in its tank leaves the model: it is taken off `supplied`.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import StrictBool, model_validator
from scipy.spatial.transform import Rotation

from femflex.arrays import Array
from femflex.effectors.noun import Mounted, unit_direction
from femflex.effectors.signal import step_of
from femflex.effectors.tank import Tank
from femflex.kernels.vectors import ZERO, add, dot, load3, load9, scale, store3, sub, turn
from femflex.noun.problems import suggestion_text
from femflex.noun.table import Table, refuse
from femflex.noun.values import Direction, Duration, Quantity, Time, Whole
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector
from femflex.system.environment import STANDARD_GRAVITY

MAX_PULSES = 100_000  # of a thruster: each is two instants at which the integrator begins anew
SWITCH = 0.5  # a switched thruster is on above it


class PulseTrain(Table):
    """Equal pulses at equal intervals."""

    start: Time = 0.0
    """Start of the first pulse."""
    period: Duration
    """Time from the start of a pulse to that of the next."""
    width: Duration
    """Duration of each pulse."""
    count: Whole
    """Number of pulses."""

    def pulses(self) -> list[tuple[float, float]]:
        """Start and duration of each [s]. Raises ValueError for more than a run allows."""
        check_pulse_count(self.count)
        return [(self.start + k * self.period, self.width) for k in range(self.count)]


class LevelTable(Table):
    """Level of a thruster over time."""

    times: Annotated[tuple[float, ...], Quantity("s", (None,))]
    """Times, rising; each level holds until the next time. Before the first the thruster is off."""
    levels: tuple[Annotated[float, Quantity(least=0.0, most=1.0)], ...]
    """Level from each time on, from 0 to 1."""


class Thruster(Mounted, heading="thrusters"):
    """A thruster that turns with its marker.

    Channels: thrust and flow (of mass).
    """

    thrust: Annotated[float, Quantity("N", above=0.0)]
    """Thrust at full level."""
    axis: Direction = (1.0, 0.0, 0.0)
    """Direction of the force on the body, in the marker's axes."""
    misalignment: Annotated[tuple[float, float, float], Quantity("rad", (3,))] = (0.0, 0.0, 0.0)
    """Rotation vector that turns the axis."""
    pulses: Annotated[tuple[tuple[float, float], ...] | None, Quantity("s", (None, 2))] = None
    """Start and duration of each pulse at full thrust."""
    train: PulseTrain | None = None
    """Equal pulses, in place of pulses."""
    profile: LevelTable | None = None
    """Levels over time, in place of pulses."""
    command: str | None = None
    """Signal of the level from 0 to 1, in place of pulses."""
    switched: StrictBool = False
    """On-off: full thrust while the command is above 0.5, else none."""
    lag: Annotated[float, Quantity("s", least=0.0)] = 0.0
    """Time constant with which the thrust follows its level."""
    minimum_on: Annotated[float, Quantity("s", least=0.0)] = 0.0
    """Shortest pulse; shorter ones give an error. Of commanded thrusters the controller of kind "pulses" keeps it."""
    specific_impulse: Duration | None = None
    """Specific impulse; mass leaves at thrust / (9.80665 m/s^2 specific_impulse). Default: no mass leaves."""
    tank: str | None = None
    """Tank that the mass is taken from. Default: the craft's mass stays."""

    channels = {"thrust": "N", "flow": "kg/s"}
    writes_all = True
    derived = ("exit_speed", "takes_signal", "has_tank", "gyration_squared", "count", "table")

    @model_validator(mode="after")
    def _one_command(self) -> Thruster:
        keys = ("pulses", "train", "profile", "command")
        present = [key for key in keys if getattr(self, key) is not None]
        if len(present) != 1:
            keys_text = ", ".join(keys)
            refuse(f"found {' and '.join(present) or f'none of {keys_text}'}; give one of {keys_text}")
        if self.tank is not None and self.specific_impulse is None:
            refuse(f"found tank {self.tank!r} without specific_impulse; give it")
        if self.switched and self.command is None:
            refuse("found switched without command; pulses are on-off already, so drop it")
        return self

    def first_start(self) -> float | None:
        """Time at which it first gives thrust [s]; None where a signal commands it."""
        starts = [start for start, _ in self.pulses or ()]
        starts += [] if self.train is None else [self.train.start]
        starts += [] if self.profile is None else list(self.profile.times)
        return min(starts, default=None)

    def levels(self, name: str) -> tuple[Array, Array]:
        """Times [s] and the level from each on; none where a signal commands it. Raises ValueError."""
        if self.profile is not None:
            times, levels = np.array(self.profile.times), np.array(self.profile.levels)
            if times.shape != levels.shape or not np.all(np.diff(times) > 0.0):
                raise ValueError(f"profile of thruster {name!r} needs rising times and a level for each")
            return times, levels
        pulses = self.train.pulses() if self.train is not None else self.pulses
        return (np.zeros(0), np.zeros(0)) if pulses is None else _pulse_table(name, pulses, self.minimum_on)

    def numbers(self) -> dict[str, ArrayLike]:
        """Its fields, with the axis as it is turned, and what the table of its levels needs."""
        axis = Rotation.from_rotvec(self.misalignment).apply(unit_direction(self.label, "axis", self.axis))
        return super().numbers() | {
            "axis": axis,
            "exit_speed": STANDARD_GRAVITY * (self.specific_impulse or 0.0),
            "takes_signal": float(self.command is not None) + float(self.switched),
            **dict.fromkeys(("has_tank", "gyration_squared", "count", "table"), 0.0),
        }

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for pulses that overlap, and for a tank that is not there."""
        times, levels = self.levels(name)
        tank = self._tank(context)
        own = super().effector(name, context)
        last = [float(tank is not None), tank.gyration**2 if tank else 0.0, float(len(times)), *times, *levels]
        numbers = np.concatenate([own.parameters[:-4], last])
        made = replace(
            own,
            markers=self.markers() + (tank.markers() if tank else ()),
            states={"lagged": "N"} if self.lag else {},
            z0=np.zeros(1 if self.lag else 0),
            sizes=np.full(1 if self.lag else 0, self.thrust),
            inputs=(*((self.command,) if self.command else ()), *((f"{self.tank}.feed",) if tank else ())),
            accounts=("supplied", "mass_flow") if self.specific_impulse else ("supplied",),
            exerts=("force", "torque") if tank else ("force",),
            zeros=() if self.specific_impulse else ("flow",),
            parameters=numbers,
            breaks=times,
        )
        off = np.where(np.arange(len(numbers)) == P.thrust, 0.0, numbers)
        return replace(made, silent=partial(replace, made, parameters=off)) if len(times) else made

    def _tank(self, context: Context) -> Tank | None:
        if self.tank is None:
            return None
        tank = context.nouns.get(self.tank)
        if not isinstance(tank, Tank):
            tanks = [name for name, noun in context.nouns.items() if isinstance(noun, Tank)]
            raise ValueError(f"found tank {self.tank!r}, which is not in [tanks]; {suggestion_text(self.tank, tanks)}")
        return tank


def _pulse_table(name: str, pulses: ArrayLike, minimum_on: float) -> tuple[Array, Array]:
    """Times [s] at which pulses begin and end, and the level from each on."""
    rows = np.asarray(pulses, float).reshape(-1, 2)
    check_pulse_count(len(rows))
    if not len(rows) or not np.all(np.isfinite(rows)):
        raise ValueError(f"pulses of thruster {name!r} are rows of a start and a duration: {rows.tolist()}")
    if np.any(rows[:, 1] < minimum_on) or np.any(rows[:, 1] <= 0.0):
        short = float(rows[:, 1].min())
        raise ValueError(
            f"thruster {name!r} has a pulse of {short:g} s, and its shortest is {minimum_on:g} s; lengthen the pulse "
            "or leave it out"
        )
    ends = rows.sum(axis=1)
    if np.any(rows[1:, 0] <= ends[:-1]):
        k = int(np.argmax(rows[1:, 0] <= ends[:-1]))
        raise ValueError(
            f"pulse {k + 2} of thruster {name!r} starts at {rows[k + 1, 0]:g} s, before the previous pulse ends "
            f"({ends[k]:g} s)"
        )
    return np.column_stack([rows[:, 0], ends]).ravel(), np.tile([1.0, 0.0], len(rows))


def check_pulse_count(count: int) -> None:
    """Raise ValueError for more pulses than a run allows."""
    if count > MAX_PULSES:
        raise ValueError(
            f"found {count:.6g} pulses of one thruster; the most is {MAX_PULSES}. Leave out pulses beyond the end of "
            "the run, or give the mean thrust as a profile"
        )


P, _, _ = Thruster.places()


@Thruster.kernel
def thruster(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Markers: nozzle, then tank. Inputs: command, then feed. State: thrust, where it lags."""
    p = parameters
    has_tank = p[P.has_tank] > 0.0
    m = 2 if has_tank else 1
    input_index = 18 * m
    level = 0.0
    if p[P.takes_signal] == 0.0:
        n = int(p[P.count])
        k = step_of(t, p, P.table, n)
        level = p[P.table + n + k] if k >= 0 else 0.0
    else:
        level = min(1.0, max(0.0, seen[input_index]))
        if p[P.takes_signal] > 1.0:
            level = 1.0 if level > SWITCH else 0.0
        input_index += 1
    feed = seen[input_index] if has_tank else 1.0
    thrust = p[P.thrust] * level
    n_z = 0
    if p[P.lag] > 0.0:
        out[6 * m] = (feed * thrust - z[0]) / p[P.lag]
        thrust, n_z = z[0], 1
    thrust *= feed
    flow = thrust / p[P.exit_speed] if p[P.exit_speed] > 0.0 else 0.0
    force = scale(thrust, turn(load9(seen, 3 * m), load3(p, P.axis)))
    velocity = load3(seen, 12 * m)
    accounts, supplied = 6 * m + n_z + 2, 0.0
    if has_tank:
        tank_velocity, rate = load3(seen, 12 * m + 3), load3(seen, 15 * m + 3)
        flowing = scale(-flow, sub(velocity, tank_velocity))
        force = add(force, flowing)
        store3(out, 3, flowing)
        store3(out, 6, ZERO)
        store3(out, 9, scale(flow * p[P.gyration_squared], rate))
        energy_per_mass = dot(tank_velocity, tank_velocity) - p[P.gyration_squared] * dot(rate, rate)
        supplied = dot(flowing, tank_velocity) - 0.5 * flow * energy_per_mass
    else:
        store3(out, 3, ZERO)
    store3(out, 0, force)
    out[accounts - 2], out[accounts - 1] = thrust, flow
    out[accounts], out[accounts + 1], out[accounts + 2] = 0.0, 0.0, supplied + dot(force, velocity)
    out[accounts + 3] = flow
