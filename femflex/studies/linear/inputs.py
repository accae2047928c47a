"""Inputs of a linear model: loads and commands of a system, each as the same system with a small increment of it.

loads/NAME/force:x         one more newton of a load of the case, in its frame; also torque:x
markers/BODY.MARKER/force:x  a force or torque at a marker, in its axes
joints/FREEDOM/effort      force or torque along a slide or turn
motions/FREEDOM            acceleration of a prescribed or locked slide or turn; its value and rate become states
effectors/NAME/CHANNEL     a signal, or a command of a sampled controller
base/acceleration:x        of the base that carries the craft: minus as much weight, for motions relative to the base
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.effectors.constant_commands import UNIT, stands_for_controller
from femflex.effectors.signal import P as SIGNAL
from femflex.noun.problems import suggestion_text
from femflex.system import Controller, Effector, Joint, Load, Profile, System
from femflex.system.segments import marker_label

XYZ = ("x", "y", "z")
UNITS = {"force": "N", "torque": "N m"}
BASE = "base/acceleration"
OWN = "linear-model-input"  # name of a load that is added to a system
FIRST = 4  # index of the first gain in a block of constants
SIZE = 1.0  # of a signal or a command, in which it is stepped
STEP = 1e-4  # of that size: the first of steps that fall


@dataclass(frozen=True, eq=False)
class Input:
    """An input by its path; step: largest change of it up and down; kind: type of its owner; frame: its axes."""

    path: str
    unit: str
    kind: str
    owner: str
    component: str
    step: float
    frame: str = ""

    @property
    def is_affine(self) -> bool:
        """Whether the equations are linear in the increment, so that one difference gives their derivative."""
        return self.kind in ("load", "marker", "base", "effort")

    def with_increment(self, system: System, amount: float, coordinates: Mapping[str, float]) -> System:
        """The system with this increment of the input; coordinates: name -> value at the state."""
        if self.kind == "load":
            loads = tuple(
                _with_more_load(item, self.component, amount) if item.name == self.owner else item
                for item in system.loads
            )
            return replace(system, loads=loads)
        if self.kind == "marker":
            body, _, marker = self.owner.rpartition(".")
            quantity, _, axis = self.component.partition(":")
            acting: dict[str, Any] = {quantity: amount * np.eye(3)[XYZ.index(axis)]}
            extra = Load(name=OWN, body=body, marker=marker, frame="marker", **acting)
            return replace(system, loads=(*system.loads, extra))
        if self.kind == "effector":
            effectors = tuple(_with_more_signal(item, self.component, amount, self.owner) for item in system.effectors)
            return replace(system, effectors=effectors)
        if self.kind == "base":
            gravity = system.environment.gravity - amount * np.eye(3)[XYZ.index(self.component)]
            environment = system.environment.model_copy(update={"gravity": gravity})
            return replace(system, environment=environment)
        if self.kind == "effort":
            joint, k = joint_coordinate(system, self.owner)
            changed = _with_effort(joint, k, coordinates[self.owner], amount)
            return replace(system, joints=tuple(changed if item is joint else item for item in system.joints))
        return system

    def with_motion_change(self, system: System, t: float, coefficients: Array) -> System:
        """The system with these coefficients (n,) [m/s^k or rad/s^k] of (t - t0)^k added to its prescribed
        coordinate."""
        joint, k = joint_coordinate(system, self.owner)
        motion: list[Any] = list(joint.motion)
        motion[k] = joint.prescribed[k] + Profile(np.array([t]), coefficients[None])
        q0, u0 = joint.q0.copy(), joint.u0.copy()
        q0[k] = u0[k] = 0.0  # left out: the new motion begins elsewhere
        changed = replace(joint, motion=tuple(motion), q0=q0, u0=u0)
        return replace(system, joints=tuple(changed if item is joint else item for item in system.joints))


def joint_coordinate(system: System, name: str) -> tuple[Joint, int]:
    """The joint and the number of a slide or turn."""
    names = ((joint, joint.freedom_names()) for joint in system.joints)
    return next((joint, freedoms.index(name)) for joint, freedoms in names if name in freedoms)


def _with_effort(joint: Joint, k: int, value: float, amount: float) -> Joint:
    """The joint with a spring on a slide or turn that adds this force or torque at the present value."""
    stiffness, rest_position = joint.stiffness.copy(), joint.rest.copy()
    stiffness[k] += 1.0
    rest_position[k] = value + (joint.stiffness[k] * (joint.rest[k] - value) + amount) / stiffness[k]
    return replace(joint, stiffness=stiffness, rest=rest_position)


def all_inputs(system: System) -> dict[str, Input]:
    """All possible inputs of a system by path."""
    inputs: list[Input] = []
    largest = max(1.0, sum(body.moments.mass for body in system.bodies.values()))
    owners = [("load", load.name, f"loads/{load.name}", load.frame) for load in system.loads]
    for name, body in system.bodies.items():
        labels = {marker: marker_label(system.segments, name, marker) for marker in body.markers}
        owners += [("marker", f"{name}.{marker}", f"markers/{label}", "marker") for marker, label in labels.items()]
    for kind, owner, path, frame in owners:
        components = [(f"{quantity}:{axis}", unit) for quantity, unit in UNITS.items() for axis in XYZ]
        inputs += [
            Input(f"{path}/{component}", unit, kind, owner, component, largest, frame) for component, unit in components
        ]
    for joint in system.joints:
        for k, name in enumerate(joint.freedom_names()):
            turns = k >= len(joint.translations)
            if k in joint.prescribed:
                inputs.append(Input(f"motions/{name}", "rad/s^2" if turns else "m/s^2", "motion", name, "", 1.0))
            else:
                inputs.append(Input(f"joints/{name}/effort", "N m" if turns else "N", "effort", name, "", largest))
    for effector in system.effectors:
        if isinstance(effector, Effector) and (
            stands_for_controller(effector) or (effector.kind == "signal" and (not effector.name.endswith(UNIT)))
        ):
            for channel in ("value",) if effector.kind == "signal" else effector.channels:
                path, unit = f"effectors/{effector.name}/{channel}", effector.channels[channel]
                inputs.append(Input(path, unit, "effector", effector.name, channel, STEP * SIZE))
    if system.orbit is None:
        inputs += [Input(f"{BASE}:{axis}", "m/s^2", "base", "", axis, 1.0, "inertial") for axis in XYZ]
    return {entry.path: entry for entry in inputs}


def default_inputs(system: System, moving: Sequence[str]) -> list[str]:
    """Paths of the default inputs: loads of the case, prescribed motions that move, signals."""
    inputs = all_inputs(system)
    loads = [path for path, entry in inputs.items() if entry.kind == "load" and _load_acts(system, entry)]
    motions = [path for path, entry in inputs.items() if entry.kind == "motion" and entry.owner in moving]
    return loads + motions + [path for path, entry in inputs.items() if entry.kind == "effector"]


def inputs_of(system: System, paths: Sequence[str]) -> list[Input]:
    """The inputs of these paths; a path without its axis stands for all three. Raises KeyError, nearest path first."""
    available = all_inputs(system)
    inputs: list[Input] = []
    for path in paths:
        axes = [f"{path}:{axis}" for axis in XYZ]
        if path in available:
            inputs.append(available[path])
        elif axes[0] in available:
            inputs += [available[axis_path] for axis_path in axes]
        else:
            raise KeyError(f"the craft has no input {path!r}; {suggestion_text(path, available)}")
    return inputs


def _load_acts(system: System, entry: Input) -> bool:
    """Whether a load acts along this axis at any time."""
    load = next(load for load in system.loads if load.name == entry.owner)
    quantity, _, axis = entry.component.partition(":")
    return bool(np.any(getattr(load, quantity)[..., XYZ.index(axis)]))


def _with_more_load(load: Load, component: str, amount: float) -> Load:
    quantity, _, axis = component.partition(":")
    increment = amount * np.eye(3)[XYZ.index(axis)]
    return load.model_copy(update={quantity: getattr(load, quantity) + increment})


def _with_more_signal(
    effector: Effector | Controller, channel: str, amount: float, owner: str
) -> Effector | Controller:
    if effector.name != owner or not isinstance(effector, Effector):
        return effector
    numbers = effector.parameters.copy()
    if effector.kind == "signal":
        numbers[SIGNAL.table + int(numbers[SIGNAL.count]) :] += amount
    else:
        numbers[FIRST + list(effector.channels).index(channel)] += amount
    return replace(effector, parameters=numbers)
