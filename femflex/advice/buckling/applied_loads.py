"""Loads on bodies along a rigid-body motion: own inertia and weight, applied loads, and attached bodies.

Bodies attached at a marker transmit each of their loads, and their inertia and weight: the rest of the joint's force
and torque.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from femflex.advice.buckling.applied_forces import FOLLOWING, AppliedForce, RigidMotion
from femflex.arrays import Array
from femflex.dynamics.model import compile_system
from femflex.fem.connections.connection import skew
from femflex.reduction.static_buckling.buckling_analysis import AppliedLoad
from femflex.system import Joint, System

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
    inertia = _attached_inertia(motion, name, carried, position) * is_rigid_to_parent
    yield AppliedLoad(
        f"inertia and weight of the bodies attached at {marker!r}",
        marker,
        wrench,
        wrench,
        arm,
        n_constrained=3 * (closed and parent_is_rigid),
        inertia=inertia,
    )


def _attached_inertia(motion: RigidMotion, parent: str, carried: list[str], position: Array) -> Array:
    """Inertia (6, 6) of the bodies attached at a point of a parent, about that point, at the start, parent axes."""
    out = np.zeros((6, 6))
    for body in carried:
        moments = motion.system.bodies[body].moments
        C = motion.rotations[parent][0].T @ motion.rotations[body][0]
        c = C @ moments.center_of_mass()
        arm = motion.rotations[parent][0].T @ (motion.channels[f"bodies/{body}/position"][0] - position[0])
        J = C @ moments.inertia() @ C.T - moments.mass * ((c @ c) * np.eye(3) - np.outer(c, c))
        S = skew(arm + c)
        out += np.block([[moments.mass * np.eye(3), -moments.mass * S], [moments.mass * S, J - moments.mass * S @ S]])
    return out


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
