"""Inputs of a linear model: what acts on a system, as the same system with a little more of it.

loads/NAME/force:x         one more newton of a load of the case, in its frame; also torque:x
markers/BODY.MARKER/force:x  a force or torque at a marker, in its axes
joints/FREEDOM/effort      force or torque along a slide or turn
motions/FREEDOM            acceleration of a prescribed or locked slide or turn; its place and rate become states
effectors/NAME/CHANNEL     a signal, or a command of a sampled controller
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.case.problems import near
from femflex.system import Controller, Effector, Joint, Load, Profile, System
from femflex.system.constant_commands import UNIT, stands_for_controller
from femflex.system.segments import marker_label

XYZ = ("x", "y", "z")
UNITS = {"force": "N", "torque": "N m"}
OWN = "linear-model-input"  # name of a load that is added to a system
FIRST = 4  # number of a block of constants at which its gains begin
SIZE = 1.0  # of a signal or a command, in which it is stepped
STEP = 1e-4  # of that size: the first of steps that fall


@dataclass(frozen=True, eq=False)
class Input:
    """An input by its path; `step` is by how much it is moved up and down at most; kind says where it acts."""

    path: str
    unit: str
    kind: str
    owner: str
    part: str
    step: float

    def moved(self, system: System, amount: float, coordinates: Mapping[str, float]) -> System:
        """The system with so much more of the input; coordinates: name -> value, where it is."""
        if self.kind == "load":
            loads = tuple(_raised(one, self.part, amount) if one.name == self.owner else one for one in system.loads)
            return replace(system, loads=loads)
        if self.kind == "marker":
            body, _, marker = self.owner.rpartition(".")
            quantity, _, axis = self.part.partition(":")
            extra = Load(OWN, body, marker, "marker", **{quantity: amount * np.eye(3)[XYZ.index(axis)]})
            return replace(system, loads=(*system.loads, extra))
        if self.kind == "effector":
            effectors = tuple(_shifted(one, self.part, amount, self.owner) for one in system.effectors)
            return replace(system, effectors=effectors)
        if self.kind == "effort":
            joint, k = freedom(system, self.owner)
            pushed = _pushed(joint, k, coordinates[self.owner], amount)
            return replace(system, joints=tuple(pushed if one is joint else one for one in system.joints))
        return system

    def led(self, system: System, t: float, coefficients: Array) -> System:
        """The system with these coefficients (n,) [m/s^k or rad/s^k] of (t - t0)^k added to its prescribed
        coordinate."""
        joint, k = freedom(system, self.owner)
        motion: list[Any] = list(joint.motion)
        motion[k] = joint.prescribed[k] + Profile(np.array([t]), coefficients[None])
        q0, u0 = joint.q0.copy(), joint.u0.copy()
        q0[k] = u0[k] = 0.0  # left out: the new motion begins elsewhere
        led = replace(joint, motion=tuple(motion), q0=q0, u0=u0)
        return replace(system, joints=tuple(led if one is joint else one for one in system.joints))


def freedom(system: System, name: str) -> tuple[Joint, int]:
    """The joint and the number of a slide or turn."""
    names = ((joint, joint.freedom_names()) for joint in system.joints)
    return next((joint, freedoms.index(name)) for joint, freedoms in names if name in freedoms)


def _pushed(joint: Joint, k: int, place: float, amount: float) -> Joint:
    """The joint with a spring on a slide or turn that pushes by so much more where it is."""
    stiffness, rest = joint.stiffness.copy(), joint.rest.copy()
    stiffness[k] += 1.0
    rest[k] = place + (joint.stiffness[k] * (joint.rest[k] - place) + amount) / stiffness[k]
    return replace(joint, stiffness=stiffness, rest=rest)


def known_inputs(system: System) -> dict[str, Input]:
    """Every input that a system may have, by its path."""
    found: list[Input] = []
    mass = sum(body.moments.mass for body in system.bodies.values())
    for load in system.loads:
        for quantity, unit in UNITS.items():
            parts = [f"{quantity}:{axis}" for axis in XYZ]
            found += [
                Input(f"loads/{load.name}/{part}", unit, "load", load.name, part, max(1.0, mass)) for part in parts
            ]
    for name, body in system.bodies.items():
        for marker in body.markers:
            owner, label = f"{name}.{marker}", marker_label(system.segments, name, marker)
            for quantity, unit in UNITS.items():
                parts = [f"{quantity}:{axis}" for axis in XYZ]
                found += [Input(f"markers/{label}/{p}", unit, "marker", owner, p, max(1.0, mass)) for p in parts]
    for joint in system.joints:
        for k, name in enumerate(joint.freedom_names()):
            turns = k >= len(joint.translations)
            if k in joint.prescribed:
                unit = "rad/s^2" if turns else "m/s^2"
                found.append(Input(f"motions/{name}", unit, "motion", name, "", 1.0))
            else:
                found.append(
                    Input(f"joints/{name}/effort", "N m" if turns else "N", "effort", name, "", max(1.0, mass))
                )
    for one in system.effectors:
        if isinstance(one, Effector) and is_input(one):
            signals = {"value": one.channels["value"]} if one.act == "signal" else dict(one.channels)
            found += [
                Input(f"effectors/{one.name}/{c}", u, "effector", one.name, c, STEP * SIZE) for c, u in signals.items()
            ]
    return {one.path: one for one in found}


def is_input(one: Effector) -> bool:
    """Whether an effector is a signal, or stands for the commands of a controller."""
    return stands_for_controller(one) or (one.act == "signal" and not one.name.endswith(UNIT))


def usual_inputs(system: System, moving: Sequence[str]) -> list[str]:
    """Paths of the inputs taken where none are named: loads of the case, prescribed motions that move, signals."""
    known = known_inputs(system)
    loads = [path for path, one in known.items() if one.kind == "load" and _acts(system, one)]
    motions = [path for path, one in known.items() if one.kind == "motion" and one.owner in moving]
    return loads + motions + [path for path, one in known.items() if one.kind == "effector"]


def inputs_of(system: System, wanted: Sequence[str]) -> list[Input]:
    """The inputs of these paths; a path without its axis stands for all three. Raises KeyError, nearest path first."""
    known = known_inputs(system)
    found: list[Input] = []
    for path in wanted:
        axes = [f"{path}:{axis}" for axis in XYZ]
        if path in known:
            found.append(known[path])
        elif axes[0] in known:
            found += [known[one] for one in axes]
        else:
            raise KeyError(f"the craft has no input {path!r}; {near(path, known)}")
    return found


def _acts(system: System, one: Input) -> bool:
    """Whether a load acts along this axis at any time."""
    load = next(load for load in system.loads if load.name == one.owner)
    quantity, _, axis = one.part.partition(":")
    return bool(np.any(getattr(load, quantity)[..., XYZ.index(axis)]))


def _raised(load: Load, part: str, amount: float) -> Load:
    quantity, _, axis = part.partition(":")
    more = amount * np.eye(3)[XYZ.index(axis)]
    return replace(load, **{quantity: getattr(load, quantity) + more})


def _shifted(one: Effector | Controller, channel: str, amount: float, owner: str) -> Effector | Controller:
    if one.name != owner or not isinstance(one, Effector):
        return one
    numbers = one.parameters.copy()
    if one.act == "signal":
        numbers[2 + int(numbers[1]) :] += amount
    else:
        numbers[FIRST + list(one.channels).index(channel)] += amount
    return replace(one, parameters=numbers)
