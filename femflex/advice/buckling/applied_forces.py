"""Forces and torques on bodies at markers along a motion: of loads, loops, constraints, springs between markers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.observe.markers import marker_motion
from femflex.rotations import dcm_from_quaternion
from femflex.system import Joint, Nonholonomic, System

FOLLOWING = {"body", "marker"}  # frames of loads that turn with their body


@dataclass(frozen=True, eq=False)
class AppliedForce:
    """Force [N] and torque [N m] (n_t, 3) on a body about its marker at a position (n_t, 3) [m], inertial components.

    load: whether it is one of the system's loads; frame: that of the load's components; n_constrained: see AppliedLoad.
    """

    name: str
    body: str
    marker: str
    force: Array
    torque: Array
    position: Array
    load: bool = False
    frame: str = ""
    n_constrained: int = 0

    def wrench_about(self, position: Array) -> Array:
        """Force and torque (n_t, 6) [N, N m] about another position."""
        return np.hstack([self.force, self.torque + np.cross(self.position - position, self.force)])


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A motion of a system of rigid bodies: times (n_t,) and the channels that `observe` computes, with reactions."""

    system: System
    times: Array
    channels: Mapping[str, Array]
    rotations: dict[str, Array] = field(init=False)

    def __post_init__(self) -> None:
        rotations = {name: dcm_from_quaternion(self.channels[f"bodies/{name}/attitude"]) for name in self.system.order}
        object.__setattr__(self, "rotations", rotations)

    def marker_position(self, body: str | None, marker: str) -> Array:
        """Position (n_t, 3) [m] of a marker, inertial components."""
        return marker_motion(self.system, self.times, self.channels, body, marker)[0]

    @cached_property
    def forces(self) -> list[AppliedForce]:
        """All forces and torques at markers except those that the joints of the tree transmit."""
        return [*self._loads(), *self._ties(), *self._springs()]

    def _loads(self) -> Iterator[AppliedForce]:
        zero = np.zeros((len(self.times), 3))  # where a load has no force or no torque to report
        for load in self.system.loads:
            force, torque = (
                np.einsum(
                    "tij,tj->ti", self.rotations[load.body], self.channels.get(f"loads/{load.name}/{quantity}", zero)
                )
                for quantity in ("force", "torque")
            )
            position = self.marker_position(load.body, load.marker)
            yield AppliedForce(f"load {load.name!r}", load.body, load.marker, force, torque, position, True, load.frame)

    def _ties(self) -> Iterator[AppliedForce]:
        system = self.system
        ties: list[tuple[str, str, str, str, Joint | Nonholonomic]] = [
            (f"loops/{j.label}", f"loop {j.label!r}", j.child, j.child_marker, j) for j in system.loops
        ]
        ties += [
            (f"constraints/{c.name}", f"constraint {c.name!r}", c.body, c.marker, c)
            for c in system.constraints
            if c.body is not None
        ]
        for path, name, body, marker, tie in ties:
            force, torque = (self.channels[f"{path}/{quantity}"] for quantity in ("force", "torque"))
            n_constrained = 0 if not isinstance(tie, Joint) else 3 if tie.ball is not None or len(tie.rotations) else 6
            action = AppliedForce(
                name, body, marker, force, torque, self.marker_position(body, marker), n_constrained=n_constrained
            )
            yield action
            if tie.parent is not None:
                yield self._reaction(action, tie.parent, tie.parent_marker)

    def _springs(self) -> Iterator[AppliedForce]:
        """Forces of springs, without those of their dampers."""
        for spring in self.system.springs:
            position, other = (
                self.marker_position(spring.body, spring.marker),
                self.marker_position(spring.parent, spring.parent_marker),
            )
            line = position - other
            length = np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-300)
            force = -spring.stiffness * (length - spring.length) * line / length
            action = AppliedForce(f"spring {spring.name!r}", spring.body, spring.marker, force, 0.0 * force, position)
            yield action
            if spring.parent is not None:
                yield self._reaction(action, spring.parent, spring.parent_marker)

    def _reaction(self, action: AppliedForce, body: str, marker: str) -> AppliedForce:
        """The opposite of a force and torque, on the other body at its marker."""
        position = self.marker_position(body, marker)
        wrench = -action.wrench_about(position)
        return replace(action, body=body, marker=marker, force=wrench[:, :3], torque=wrench[:, 3:], position=position)

    def joint_force(self, body: str) -> AppliedForce:
        """Force and torque that the joint of a body exerts on it."""
        joint = self.system.joint_of(body)
        path, position = f"joints/{joint.label}", self.marker_position(body, joint.child_marker)
        force, torque = (
            self.channels.get(f"{path}/{quantity}", np.zeros_like(position)) for quantity in ("force", "torque")
        )
        return AppliedForce(f"its joint {joint.label!r}", body, joint.child_marker, force, torque, position)
