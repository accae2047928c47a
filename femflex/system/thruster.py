"""Thrusters at markers of any body, and the tanks that they draw from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments
from femflex.system.attached import attached_moments, least_second_moment
from femflex.system.effector import Effector, StateEvent
from femflex.system.environment import STANDARD_GRAVITY
from femflex.system.variation import Block, Variation
from femflex.system.wheel import unit_direction

BY_TABLE, CONTINUOUS, SWITCHED = 0.0, 1.0, 2.0

MAX_PULSES = 100_000  # of a thruster: each is two instants at which the integrator begins anew


class Supply(NamedTuple):
    """The tank that a thruster draws from: its name, its place, and the gyration radius of its propellant [m].

    The inertia of the propellant about its own centre is mass gyration^2 about every axis.
    """

    tank: str
    body: str
    marker: str = "origin"
    gyration: float = 0.0


def thruster(
    name: str,
    body: str,
    thrust: float,
    *,
    marker: str = "origin",
    axis: ArrayLike = (1.0, 0.0, 0.0),
    misalignment: ArrayLike = (0.0, 0.0, 0.0),
    pulses: Sequence[tuple[float, float]] | None = None,
    profile: tuple[Sequence[float], Sequence[float]] | None = None,
    command: str | None = None,
    switched: bool = False,
    lag: float = 0.0,
    minimum_on: float = 0.0,
    specific_impulse: float | None = None,
    supply: Supply | None = None,
) -> Effector:
    """A thruster that pushes its body along an axis of a marker with `thrust` [N] at full level.

    misalignment      rotation vector that turns the axis [rad]
    pulses            (start, duration) of each [s], at full thrust; or
    profile           times [s] and the level (0 to 1) from each time on; or
    command           signal of the level; switched: on above 0.5, else off
    lag               of the thrust behind its level [s], of first order
    minimum_on        shortest pulse [s]; shorter pulses give an error
    specific_impulse  [s]; mass leaves at thrust / (9.80665 specific_impulse)
    supply            the tank that it is taken from; None: the craft's mass stays as it is

    Channels: thrust [N], flow [kg/s]. Raises ValueError for what does not fit together.
    """
    if sum(what is not None for what in (pulses, profile, command)) != 1:
        raise ValueError(f"thruster {name!r} needs one of pulses, profile and command")
    if not (thrust > 0.0 and lag >= 0.0 and (specific_impulse is None or specific_impulse > 0.0)):
        raise ValueError(f"thrust and specific_impulse of thruster {name!r} must be positive, its lag not negative")
    if supply is not None and specific_impulse is None:
        raise ValueError(f"thruster {name!r} draws from tank {supply.tank!r} and has no specific_impulse; give it")
    times, levels = np.zeros(0), np.zeros(0)
    if pulses is not None:
        times, levels = _pulse_table(name, pulses, minimum_on)
    elif profile is not None:
        times, levels = np.asarray(profile[0], float), np.asarray(profile[1], float)
        if times.shape != levels.shape or times.ndim != 1 or not np.all(np.diff(times) > 0.0):
            raise ValueError(f"profile of thruster {name!r} needs rising times and a level for each")
        if np.any((levels < 0.0) | (levels > 1.0)):
            raise ValueError(f"levels of thruster {name!r} must lie between 0 and 1: {levels.tolist()}")
    kind = BY_TABLE if command is None else SWITCHED if switched else CONTINUOUS
    turn = np.asarray(misalignment, float)
    d = unit_direction(name, "axis", axis)
    angle = float(np.linalg.norm(turn))
    if angle:
        k = turn / angle
        d = d * np.cos(angle) + np.cross(k, d) * np.sin(angle) + k * (k @ d) * (1.0 - np.cos(angle))
    exit_speed = STANDARD_GRAVITY * (specific_impulse or 0.0)
    tanked = [float(supply is not None)] * 2 + [supply.gyration**2 if supply else 0.0]
    feed = () if supply is None else (f"{supply.tank}.feed",)
    return Effector(
        name,
        "thruster",
        ((body, marker), *(() if supply is None else ((supply.body, supply.marker),))),
        states={"lagged": "N"} if lag else {},
        sizes=np.array([thrust]) if lag else np.zeros(0),
        inputs=(*(() if command is None else (command,)), *feed),
        channels={"thrust": "N", "flow": "kg/s"},
        accounts=("supplied", "mass_flow") if exit_speed else ("supplied",),
        exerts=("force",) if supply is None else ("force", "torque"),
        parameters=np.concatenate([d, [thrust, exit_speed, lag, kind], tanked, [float(len(times))], times, levels]),
        breaks=times,
    )


def _pulse_table(name: str, pulses: Sequence[tuple[float, float]], minimum_on: float) -> tuple[Array, Array]:
    check_pulse_count(len(pulses))
    rows = np.asarray(pulses, float).reshape(-1, 2)
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


def pulse_train(start: float, period: float, width: float, count: int) -> list[tuple[float, float]]:
    """Return (start, duration) of `count` equal pulses. Raises ValueError for more than a run allows."""
    check_pulse_count(count)
    return [(start + k * period, width) for k in range(count)]


def check_pulse_count(count: int) -> None:
    """Raise ValueError for more pulses than a run allows."""
    if count > MAX_PULSES:
        raise ValueError(
            f"found {count:.6g} pulses of one thruster; the most is {MAX_PULSES}. Leave out pulses beyond the end of "
            "the run, or give the mean thrust as a profile"
        )


def tank(name: str, propellant: float, thrusters: Sequence[str]) -> Effector:
    """A tank of propellant [kg] that thrusters draw from; empty is an event, at which their thrust ends.

    States: mass [kg]; feed, 1 while there is propellant; emptied, the time of the event [s] (-1 before).
    """
    if not propellant > 0.0:
        raise ValueError(f"tank {name!r} holds {propellant:g} kg of propellant; it must be positive")
    if not thrusters:
        raise ValueError(f"no thruster draws from tank {name!r}; let one draw from it, or leave the tank out")
    return Effector(
        name,
        "tank",
        states={"mass": "kg", "feed": "1", "emptied": "s"},
        z0=np.array([propellant, 1.0, -1.0]),
        sizes=np.array([propellant, 1.0, 1.0]),
        inputs=tuple(f"{thruster}.flow" for thruster in thrusters),
        parameters=np.array([float(len(thrusters))]),
        events=(StateEvent("empty", _remaining_mass, _emptied_state),),
    )


def _remaining_mass(t: float, z: Array) -> float:
    return float(z[0]) if z[1] > 0.0 else 1.0


def _emptied_state(t: float, z: Array) -> Array:
    return np.array([0.0, 0.0, t])


def tank_variation(body: FlexibleBody, tanks: Mapping[str, tuple[str, float, float]]) -> Variation:
    """Return the variation of a body with the masses in its tanks; the body as it stands has them full.

    tanks: name -> (marker, mass of propellant at the start [kg], gyration radius [m])
    """
    block = Block(body, ("mass",))
    units = {
        name: attached_moments(body, marker, 1.0, gyration**2 * np.eye(3))
        for name, (marker, _, gyration) in tanks.items()
    }
    dry = body.moments
    for name, (_, mass, _) in tanks.items():
        u = units[name]
        dry = MassMoments(dry.mass - mass * u.mass, dry.first - mass * u.first, dry.second - mass * u.second)
    if not dry.mass > 0.0:
        raise ValueError(
            f"the tanks {', '.join(tanks)} hold {body.moments.mass - dry.mass:g} kg of propellant, and their body "
            f"has a mass of {body.moments.mass:g} kg; set the propellant as added, or raise the body's mass"
        )
    if (least := least_second_moment(dry)) < 0.0:
        raise ValueError(
            f"the tanks {', '.join(tanks)} leave a second moment int x^2 dm of {least:.4g} kg m^2 along an axis when "
            "they are empty; the "
            "body's inertia does not contain that of the propellant: lower its gyration radius, set the propellant as "
            "added, or raise the body's inertia"
        )
    rows = []
    for moments in (dry, *units.values()):
        row = np.zeros(block.size)
        block.put_moments(row, moments)
        rows.append(row)
    states = tuple(f"{name}.mass" for name in tanks)
    return Variation("tanks", ("mass",), np.concatenate([[-1.0, float(block.size)], *rows]), states=states)
