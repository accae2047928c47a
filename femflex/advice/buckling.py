"""Buckling of bodies along a rigid-body motion under their inertia and weight, applied loads and attached bodies.

Bodies attached at a marker transmit each of their loads, and their inertia and weight: the rest of the joint's force
and torque.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import BodyOrigin, BodyOrigins
from femflex.advice.limits import (
    BASIS_OVERESTIMATE,
    BUCKLING_FACTOR,
    CONDENSED_INVALID_ABOVE,
    LISTED_SHARE,
    SINGLE_LOAD_SHARE,
)
from femflex.advice.motion_estimate import RigidEstimate
from femflex.arrays import Array
from femflex.dynamics.model import compile_system
from femflex.dynamics.observe.markers import marker_motion
from femflex.reduction.static_buckling.buckling_analysis import AppliedLoad, BucklingResult
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


OWN = "its own inertia and weight"


def applied_loads(system: System, names: Iterable[str], times: Array, states: Array) -> dict[str, list[AppliedLoad]]:
    """All loads on each of these bodies by its name, in body axes; units as in `AppliedLoad`.

    system: of rigid bodies that reports reactions; states (n_t, n_x) of its model at times (n_t,) [s].
    """
    model = compile_system(system)
    motion = RigidMotion(system, times, model.observation(times, states))
    return {name: list(_loads_on_body(motion, name)) for name in names}


def _loads_on_body(motion: RigidMotion, name: str) -> Iterator[AppliedLoad]:
    """The loads of its joint, of forces at its markers, of attached bodies and of its inertia and weight on a body."""
    system = motion.system
    forces = [motion.joint_force(name)]
    forces += [force for force in motion.forces if force.body == name]
    is_rigid = _is_rigidly_connected(system, name, None)
    for force in forces:
        load = _load_at_marker(
            motion, name, force, force.marker, force.position, force.load and force.frame == "marker"
        )
        yield replace(load, n_constrained=force.n_constrained * is_rigid)
    total = _total_about_origin(motion, name, forces)
    for joint in system.joints:
        if joint.parent == name:
            attached_loads = list(_attached(motion, joint, is_rigid))
            yield from attached_loads
            arm = motion.marker_position(name, joint.parent_marker) - motion.channels[f"bodies/{name}/position"]
            wrench = np.sum([load.wrench for load in attached_loads], axis=0)
            total += np.hstack(
                [wrench[:, :3], wrench[:, 3:] + np.cross(_body_components(motion, name, arm), wrench[:, :3])]
            )
    yield _inertia_field(motion, name, total)


def _attached(motion: RigidMotion, joint: Joint, parent_is_rigid: bool) -> Iterator[AppliedLoad]:
    """Loads that the bodies attached at a marker pass on to the parent: applied loads one by one, inertia and weight.

    parent_is_rigid: whether loops that close over the attached bodies hold the parent too.
    """
    assert joint.parent is not None
    system, name, marker = motion.system, joint.parent, joint.parent_marker
    position = motion.marker_position(name, marker)
    carried = [body for body in system.order if _is_carried_by(system, body, joint.child)]
    remaining = -motion.joint_force(joint.child).wrench_about(position)
    for force in motion.forces:
        if force.load and force.body in carried:
            is_rigid_to_parent = _is_rigidly_connected(system, force.body, name)
            yield _load_at_marker(
                motion,
                name,
                force,
                marker,
                position,
                is_rigid_to_parent and force.frame in FOLLOWING,
                is_rigid_to_parent,
            )
            remaining = remaining - force.wrench_about(position)
    mass = [system.bodies[body].moments.mass for body in carried]
    centres = [
        motion.channels[f"bodies/{body}/position"]
        + motion.rotations[body] @ system.bodies[body].moments.center_of_mass()
        for body in carried
    ]
    centre = position if not sum(mass) else np.einsum("b,bti->ti", mass, centres) / sum(mass)
    is_rigid_to_parent = _is_rigidly_connected(system, joint.child, name)
    wrench = np.hstack(
        [_body_components(motion, name, remaining[:, :3]), _body_components(motion, name, remaining[:, 3:])]
    )
    arm = _body_components(motion, name, centre - position) * is_rigid_to_parent
    closed = any(force.n_constrained and force.body in carried for force in motion.forces)
    yield AppliedLoad(
        f"inertia and weight of the bodies attached at {marker!r}",
        marker,
        wrench,
        wrench,
        arm,
        n_constrained=3 * (closed and parent_is_rigid),
    )


def _load_at_marker(
    motion: RigidMotion,
    name: str,
    force: AppliedForce,
    marker: str,
    position: Array,
    follows: bool,
    stiff: bool = False,
) -> AppliedLoad:
    """An applied force as a load at a marker of the body."""
    wrench = force.wrench_about(position)
    wrench = np.hstack([_body_components(motion, name, wrench[:, :3]), _body_components(motion, name, wrench[:, 3:])])
    text = force.name if force.body == name else f"{force.name} on {force.body!r}"
    return AppliedLoad(
        text, marker, wrench, wrench, _body_components(motion, name, force.position - position) * stiff, follows
    )


def _inertia_field(motion: RigidMotion, name: str, total: Array) -> AppliedLoad:
    """The distributed load of a body's inertia and weight, from the total force and torque (n_t, 6) about its origin.

    Force and torque are m (b + W c) and, about the centre of mass c, J alpha + omega x J omega; W = skew(alpha) +
    omega omega^T - omega^2 1. A body without inertia about an axis gets no angular acceleration about it.
    """
    moments = motion.system.bodies[name].moments
    c, omega = moments.center_of_mass(), motion.channels[f"bodies/{name}/rate"]
    J = moments.inertia() - moments.mass * ((c @ c) * np.eye(3) - np.outer(c, c))
    torque = total[:, 3:] - np.cross(c, total[:, :3]) - np.cross(omega, omega @ J)
    alpha = torque @ np.linalg.pinv(J, rcond=1e-9, hermitian=True)
    W = omega[:, :, None] * omega[:, None, :] - np.einsum("ti,ti,jk->tjk", omega, omega, np.eye(3))
    W = W + np.cross(alpha[:, None, :], np.eye(3)).swapaxes(1, 2)
    b = total[:, :3] / moments.mass - W @ c
    values = np.hstack([b, W.swapaxes(1, 2).reshape(-1, 9)])
    return AppliedLoad(OWN, None, values, np.hstack([-total[:, :3], np.zeros_like(b)]))


def _total_about_origin(motion: RigidMotion, name: str, forces: list[AppliedForce]) -> Array:
    """Total force and torque (n_t, 6) [N, N m] of these forces about a body's origin, in its axes."""
    total = np.sum([force.wrench_about(motion.channels[f"bodies/{name}/position"]) for force in forces], axis=0)
    return np.hstack([_body_components(motion, name, total[:, :3]), _body_components(motion, name, total[:, 3:])])


def _body_components(motion: RigidMotion, name: str, vector: Array) -> Array:
    """Components (n_t, 3) of an inertial vector in axes of a body."""
    return np.asarray(np.einsum("tji,tj->ti", motion.rotations[name], vector))


def _is_carried_by(system: System, body: str | None, below: str) -> bool:
    """Whether a body is `below`, or is carried by it."""
    while body is not None and body != below:
        body = system.joint_of(body).parent
    return body == below


def _is_rigidly_connected(system: System, body: str | None, below: str | None) -> bool:
    """Whether no joint between a body and one that carries it, or the base frame, lets it turn."""
    while body is not None and body != below:
        joint = system.joint_of(body)
        if any(k not in joint.prescribed for k in range(len(joint.translations), joint.n_u)):
            return False
        body = joint.parent
    return True


CONDENSED_NOTE = (
    f"; above {CONDENSED_INVALID_ABOVE:g} of it, condensed strain gives too small a deflection, because its "
    "foreshortening is of second order. Use strain = 'nonlinear' up to the buckling load, and segments beyond it"
)


@dataclass(frozen=True)
class BucklingMargin:
    """Load on a body at the worst instant, over its buckling load.

    load_text: the load, in words; contributions: of each load, in words; loads: all loads; row: number of the
    instant.
    """

    load_text: str
    ratio: float
    contributions: str = ""
    loads: tuple[AppliedLoad, ...] = ()
    row: int = 0

    def __str__(self) -> str:
        return f"{self.load_text} is {self.ratio:.3g} of the linear buckling load" + (
            f" ({self.contributions})" if self.contributions else ""
        )


def assessed_bodies(system: System, origins: BodyOrigins) -> list[str]:
    """Names of the bodies with a buckling analysis."""
    return [name for name in system.bodies if name in origins and origins[name].buckling_model is not None]


def buckling_margins(rigid: RigidEstimate | None, system: System, origins: BodyOrigins) -> dict[str, BucklingMargin]:
    """Margins of the bodies whose load reaches 1 / BUCKLING_FACTOR of the buckling load in the rigid-body simulation.

    Empty where there is no simulation; see `unassessed_bodies`.
    """
    names = assessed_bodies(system, origins)
    if not names or rigid is None:
        return {}
    loads = applied_loads(replace(rigid.system, reactions=True), names, rigid.times, rigid.states)
    margins = {}
    for name in names:
        model = origins[name].buckling_model
        assert model is not None
        worst = model.worst_instant(loads[name], 1.0 / BUCKLING_FACTOR)
        if worst.ratio >= 1.0 / BUCKLING_FACTOR:
            cause, contributions = _dominant_load(loads[name], worst, float(rigid.times[worst.row]))
            margins[name] = BucklingMargin(cause, worst.ratio, contributions, tuple(loads[name]), worst.row)
    return margins


def unassessed_bodies(
    system: System, origins: BodyOrigins, rigid: RigidEstimate | None, shortfall: str
) -> list[Advice]:
    """Notes on the bodies whose buckling is assessed for a part of the run only; none where it is for the whole run."""
    text = f"buckling is not assessed: its motion is estimated {shortfall}"
    if rigid is not None:
        shortfall, text = rigid.shortfall, f"buckling is assessed {rigid.shortfall}"
    return [Advice(name, "buckling", None, text) for name in assessed_bodies(system, origins)] if shortfall else []


def buckling_warnings(system: System, origins: BodyOrigins, margins: Mapping[str, BucklingMargin]) -> list[Advice]:
    """Warnings of bodies whose strain does not represent the effect of their loads near buckling."""
    out = []
    for name, margin in margins.items():
        form = system.bodies[name].strain_form
        if form == "nonlinear" and "response" in system.bodies[name].kinds:
            continue  # its shapes are static responses past buckling
        text = {
            "linear": "; linear strain leaves this out",
            "condensed": CONDENSED_NOTE * (margin.ratio >= CONDENSED_INVALID_ABOVE),
        }.get(form, "")
        for note in filter(None, (text, "" if form == "linear" else late_buckling_note(origins[name], margin))):
            out.append(doubt(name, "buckling", f"bodies.{name}: {margin}{note}", margin.ratio, 1.0 / BUCKLING_FACTOR))
    return out


def late_buckling_note(origin: BodyOrigin, margin: BucklingMargin) -> str:
    """Note that the reduced basis buckles at a higher load than the body; empty where it does not."""
    if origin.buckling_model is None:
        return ""
    reduced = origin.buckling_model.reduced_ratio(margin.loads, margin.row)
    if margin.ratio <= (1.0 + BASIS_OVERESTIMATE) * reduced:
        return ""
    return (
        f", but {reduced:.3g} of the buckling load of the reduced basis, which represents the prestress, or the "
        "coupled "
        "torsion, inaccurately. Add the static shape of the load to the reduction (`loads`), or more modes, "
        "torsion included"
    )


def _dominant_load(loads: list[AppliedLoad], result: BucklingResult, t: float) -> tuple[str, str]:
    """Text on the single load that causes the ratio, or on the total load, and on the contribution of each load."""
    order = np.argsort(result.shares)[::-1]
    time_text = f" at t = {t:.4g} s" if result.row else ""
    first = loads[order[0]]
    if result.shares[order[0]] >= SINGLE_LOAD_SHARE * result.ratio:
        return f"{first.name} ({first.size(result.row)}{time_text})", ""
    listed = [k for k in order if abs(result.shares[k]) >= LISTED_SHARE * result.ratio]
    parts = [f"{loads[k].name} ({loads[k].size(result.row)}) {result.shares[k]:.3g}" for k in listed]
    return f"its total load{time_text}", ", ".join(parts)
