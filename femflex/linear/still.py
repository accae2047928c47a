"""A system at one instant: all that changes over time is constant; and what then still keeps it from rest.

Wheels and gyros about a steady state are rotors of constant momentum, which make small motions gyroscopic.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from femflex.dynamics.effector_states import with_linear_effectors
from femflex.dynamics.model import compile_system
from femflex.dynamics.motion.freedoms import refuse_rolling
from femflex.system import Effector, Joint, Load, Profile, System, Threshold
from femflex.system.fixed_length import moving_lengths, with_fixed_lengths
from femflex.system.joint_coordinates import OPEN, RELEASED
from femflex.system.orbit import CIRCULAR

ROUNDING = 1e-12  # relative; gravity this nearly along the axis of spin is along it


def frozen_system(system: System, at: float | None = None) -> System:
    """The system with loads, prescribed motions, releases and lengths of deploying bodies as they are at a time [s].

    Raises ValueError with what changes over time there for a system at rest in its base frame.
    """
    refuse_rolling(system, "an equilibrium")
    if at is None and (moving := moving_lengths(system)):
        raise ValueError(
            f"the length of body {moving[0]!r} changes over time, so there is no equilibrium with it; say at which "
            "time its value is meant (--at)"
        )
    system = with_fixed_lengths(system, at or 0.0)
    frozen = replace(
        with_linear_effectors(system),
        joints=tuple(_locked(joint, at) for joint in system.joints),
        loads=tuple(_frozen(load, at) for load in system.loads),
        z0=system.z0 | _released(system, at),
    )
    if problems := [*_orbit_problems(frozen), *_gravity_problems(frozen), *_load_problems(frozen)]:
        raise ValueError("\n".join(problems))
    return frozen


def without_variation(system: System) -> tuple[System, tuple[str, ...]]:
    """The system without loads over time, prescribed motions and lengths at their initial values; and their names."""
    varying = [load for load in system.loads if load.times is not None]
    moving = [joint for joint in system.joints if any(profile.moves for profile in joint.prescribed.values())]
    names = [f"load {load.name!r}" for load in varying] + [f"motion of {joint.label!r}" for joint in moving]
    names += [f"length of {name!r}" for name in moving_lengths(system)]
    names += [e.linear_note for e in system.effectors if isinstance(e, Effector) and e.linear and e.linear_note]
    fixed = replace(with_fixed_lengths(system, 0.0), loads=tuple(load for load in system.loads if load not in varying))
    joints = tuple(_locked(joint, 0.0) if joint in moving else joint for joint in system.joints)
    return replace(fixed, joints=joints), tuple(names)


def without_damping(system: System) -> System:
    """The system without the damping of bodies, joints and springs."""
    return replace(
        system,
        bodies={name: replace(body, damping=0.0 * body.damping) for name, body in system.bodies.items()},
        joints=tuple(replace(joint, damping=0.0 * joint.damping) for joint in system.joints),
        springs=tuple(spring.model_copy(update={"damping": 0.0}) for spring in system.springs),
    )


def _locked(joint: Joint, at: float | None) -> Joint:
    """The joint with its prescribed freedoms locked where they are at a time, and locked if it awaits a value."""
    still: list[Profile | float | None] = list(joint.motion)
    q0 = joint.q0.copy()
    for k, profile in joint.prescribed.items():
        if profile.moves and at is None:
            raise ValueError(
                f"the motion of {joint.freedom_names()[k]!r} changes over time, so there is no equilibrium with it; "
                "say at which time its value is meant (--at), or let the base frame spin instead ([attitude] frame = "
                "'spinning')"
            )
        still[k] = q0[k] = float(profile(at or 0.0)[0])
    latches = tuple(
        latch.model_copy(update={"opens": math.inf}) if isinstance(latch.opens, Threshold) else latch
        for latch in joint.latches
    )
    return replace(joint, motion=tuple(still), latches=latches, q0=q0, u0=0.0 * joint.u0)


def _released(system: System, at: float | None) -> dict[str, float]:
    """States of the latches that have opened at a time; without one, none has."""
    return {
        joint.state_names()[len(OPEN) * k][0]: RELEASED
        for joint in system.joints
        for k, latch in enumerate(joint.latches)
        if at is not None and isinstance(latch.opens, int | float) and latch.opens <= at
    }


def _frozen(load: Load, at: float | None) -> Load:
    """The load as it is at a time; without one, a load that does not change."""
    if load.times is None:
        return load
    values = [
        np.array([np.interp(at or 0.0, load.times, row, 0.0, 0.0) for row in rows.T])
        for rows in (load.force, load.torque)
    ]
    if at is None and (np.ptp(load.force, axis=0).any() or np.ptp(load.torque, axis=0).any()):
        raise ValueError(
            f"load {load.name!r} changes over time, so there is no equilibrium under it; say at which time its value "
            "is meant (--at), or switch it off"
        )
    return load.steady(*values)


def _orbit_problems(system: System) -> list[str]:
    orbit, kind = system.orbit, system.frame.kind
    if orbit is None:
        return []
    out = []
    if orbit.eccentricity > CIRCULAR:
        out.append(
            f"the orbit's eccentricity is {orbit.eccentricity:g}, and gravity and its frame's rate change along it; "
            "an equilibrium in orbit needs a circular one"
        )
    elif not orbit.is_steady:
        out.append(
            f"the orbit's node turns at {orbit.node_rate:.4g} rad/s, and the rate of its frame changes along it; an "
            "equilibrium in orbit needs a plane that stays: leave orbit.secular_rates out"
        )
    if kind != "orbital":
        out.append(
            f"the attitude is measured from the {kind} frame, in which the direction of gravity turns once per orbit; "
            "an equilibrium in orbit is at rest in the orbital frame"
        )
    return out


def _gravity_problems(system: System) -> list[str]:
    g, rate = system.environment.gravity, system.frame.rate
    across = float(np.linalg.norm(np.cross(g, rate)))
    if system.frame.kind != "spinning" or across <= ROUNDING * float(np.linalg.norm(g) * np.linalg.norm(rate)):
        return []
    return [
        f"gravity {g.tolist()} m/s^2 changes its direction in the frame that spins at {rate.tolist()} rad/s; an "
        "equilibrium in a spinning frame needs gravity along its axis, or none"
    ]


def _load_problems(system: System) -> list[str]:
    turning = {"inertial": [], "orbital": ["inertial"], "spinning": ["inertial"]}[system.frame.kind]
    return [
        f"load {load.name!r} keeps its direction in the {load.frame} frame, relative to which the {system.frame.kind} "
        "frame turns; an equilibrium needs loads that turn with the craft (frame 'body' or 'marker')"
        for load in system.loads
        if load.frame in turning and (load.force.any() or load.torque.any())
    ]


def with_coasting_rotors(system: System, keep: Collection[str] = ()) -> System:
    """The system whose wheels and gyros keep their momentum and gimbal angles of the start, without states.

    A motor that gives a torque accelerates its wheel for ever, so nothing else is a steady state. Left as they are:
    those whose signals something else takes, for there is a loop around them, and those to keep.
    """
    in_loops = {name.rpartition(".")[0] for e in system.effectors if isinstance(e, Effector) for name in e.inputs}
    in_loops |= set(keep)
    rotors = [e for e in system.effectors if isinstance(e, Effector) and e.coasting and e.name not in in_loops]
    if not rotors:
        return system
    names = [name for name, _ in system.state_names()]
    model = compile_system(system)
    z = dict(zip(names, model.parts(model.x0)[2], strict=True))
    changed: list[Effector] = []
    for rotor in rotors:
        states = np.array([z[name] for name, _ in rotor.state_names()])
        assert rotor.coasting is not None
        changed.append(rotor.coasting(rotor.name, states))
    new = {rotor.name: rotor for rotor in changed}
    removed = {name for rotor in rotors for name, _ in rotor.state_names()}
    effectors = tuple(new.get(e.name, e) for e in system.effectors)
    return replace(system, effectors=effectors, z0={k: v for k, v in system.z0.items() if k not in removed})


def controlled_rotors(system: System) -> list[str]:
    """Return the names of wheels and gyros that a continuous law commands by measurements of sensors."""
    by_name = {e.name: e for e in system.effectors if isinstance(e, Effector)}

    def measures(name: str, visited: frozenset[str]) -> bool:
        effector = by_name.get(name)
        if effector is None or name in visited:
            return False
        sources = {source.rpartition(".")[0] for source in effector.inputs}
        return effector.kind == "sensor" or any(measures(source, visited | {name}) for source in sources)

    return [name for name, effector in by_name.items() if effector.coasting and measures(name, frozenset())]
