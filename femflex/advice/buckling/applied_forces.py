"""Forces and torques on bodies at markers along a motion: of loads, loops, constraints, springs between markers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.rotations import dcm_from_quaternion
from femflex.system import Joint, Nonholonomic, System

FOLLOWING = {"body", "marker"}  # frames of loads that turn with their body


@dataclass(frozen=True, eq=False)
class AppliedForce:
    """Force and torque (n_t, 3) on a body about its marker at a place (n_t, 3), inertial components.

    load: whether it is one of the system's loads; frame: in whose axes it is given; held: see AppliedLoad.
    """

    name: str
    body: str
    marker: str
    force: Array
    torque: Array
    place: Array
    load: bool = False
    frame: str = ""
    held: int = 0

    def about(self, place: Array) -> Array:
        """Force and torque (n_t, 6) [N, N m] about another place."""
        return np.hstack([self.force, self.torque + np.cross(self.place - place, self.force)])


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A motion of a system of rigid bodies: times (n_t,) and what `observe` tells of it, reactions too."""

    system: System
    times: Array
    seen: Mapping[str, Array]
    turned: dict[str, Array] = field(init=False)

    def __post_init__(self) -> None:
        turned = {name: dcm_from_quaternion(self.seen[f"bodies/{name}/attitude"]) for name in self.system.order}
        object.__setattr__(self, "turned", turned)

    def place(self, body: str | None, marker: str) -> Array:
        """Place (n_t, 3) [m] of a marker, inertial components."""
        return marker_motion(self.system, self.times, self.seen, body, marker)[0]

    @cached_property
    def pushes(self) -> list[AppliedForce]:
        """All that acts at markers but what the joints of the tree carry."""
        return [*self._loads(), *self._ties(), *self._springs()]

    def _loads(self) -> Iterator[AppliedForce]:
        none = np.zeros((len(self.times), 3))  # of a force or torque that a load does not have, and does not report
        for load in self.system.loads:
            force, torque = (
                np.einsum("tij,tj->ti", self.turned[load.body], self.seen.get(f"loads/{load.name}/{what}", none))
                for what in ("force", "torque")
            )
            place = self.place(load.body, load.marker)
            yield AppliedForce(f"load {load.name!r}", load.body, load.marker, force, torque, place, True, load.frame)

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
            force, torque = (self.seen[f"{path}/{what}"] for what in ("force", "torque"))
            held = 0 if not isinstance(tie, Joint) else 3 if tie.ball is not None or len(tie.rotations) else 6
            on = AppliedForce(name, body, marker, force, torque, self.place(body, marker), held=held)
            yield on
            if tie.parent is not None:
                yield self._back(on, tie.parent, tie.parent_marker)

    def _springs(self) -> Iterator[AppliedForce]:
        """Springs at rest: what their dampers do is left out."""
        for spring in self.system.springs:
            place, other = self.place(spring.body, spring.marker), self.place(spring.parent, spring.parent_marker)
            line = place - other
            length = np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-300)
            force = -spring.stiffness * (length - spring.length) * line / length
            on = AppliedForce(f"spring {spring.name!r}", spring.body, spring.marker, force, 0.0 * force, place)
            yield on
            if spring.parent is not None:
                yield self._back(on, spring.parent, spring.parent_marker)

    def _back(self, on: AppliedForce, body: str, marker: str) -> AppliedForce:
        """What answers it on the other body."""
        place = self.place(body, marker)
        wrench = -on.about(place)
        return replace(on, body=body, marker=marker, force=wrench[:, :3], torque=wrench[:, 3:], place=place)

    def joint(self, body: str) -> AppliedForce:
        """What the joint of a body exerts on it."""
        joint = self.system.joint_of(body)
        path, place = f"joints/{joint.label}", self.place(body, joint.child_marker)
        force, torque = (self.seen.get(f"{path}/{what}", np.zeros_like(place)) for what in ("force", "torque"))
        return AppliedForce(f"its joint {joint.label!r}", body, joint.child_marker, force, torque, place)
