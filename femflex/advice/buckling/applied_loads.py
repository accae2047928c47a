"""Loads on bodies along a rigid-body motion: own inertia and weight, applied loads, and attached bodies.

Bodies attached at a marker pass on their own loads, one by one, and their inertia and weight. These are the rest of the
force and torque in the joint there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from femflex.advice.buckling.applied_forces import FOLLOWING, AppliedForce, RigidMotion
from femflex.advice.buckling.applied_load import AppliedLoad, skew
from femflex.arrays import Array
from femflex.dynamics.model import compile_system
from femflex.system import Joint, System

OWN = "its own inertia and weight"


def applied_loads(system: System, names: Iterable[str], times: Array, states: Array) -> dict[str, list[AppliedLoad]]:
    """All loads on these bodies, body axes [N, N m]; times (n_t,), states (n_t, n_x).

    system: of rigid bodies that reports reactions; states (n_t, n_x) of its model at times (n_t,).
    """
    model = compile_system(system)
    motion = RigidMotion(system, times, model.observe(times, states))
    return {name: list(_of(motion, name)) for name in names}


def _of(motion: RigidMotion, name: str) -> Iterator[AppliedLoad]:
    """Loads on a body."""
    system = motion.system
    acting = [motion.joint(name)]
    acting += [force for force in motion.pushes if force.body == name]
    held = _stiffly(system, name, None)
    for force in acting:
        one = _referred(motion, name, force, force.marker, force.place, force.load and force.frame == "marker")
        yield replace(one, held=force.held * held)
    total = _about_origin(motion, name, acting)
    for joint in system.joints:
        if joint.parent == name:
            attached = list(_attached(motion, joint, held))
            yield from attached
            arm = motion.place(name, joint.parent_marker) - motion.seen[f"bodies/{name}/position"]
            wrench = np.sum([one.wrench for one in attached], axis=0)
            total += np.hstack([wrench[:, :3], wrench[:, 3:] + np.cross(_in(motion, name, arm), wrench[:, :3])])
    yield _field(motion, name, total)


def _attached(motion: RigidMotion, joint: Joint, held: bool) -> Iterator[AppliedLoad]:
    """Loads that the bodies attached at a marker pass on to the parent: applied loads one by one, inertia and weight.

    held: whether loops that close over the attached bodies hold the parent too.
    """
    assert joint.parent is not None
    system, name, at = motion.system, joint.parent, joint.parent_marker
    place = motion.place(name, at)
    carried = [body for body in system.order if _stands_on(system, body, joint.child)]
    rest = -motion.joint(joint.child).about(place)
    for force in motion.pushes:
        if force.load and force.body in carried:
            stiff = _stiffly(system, force.body, name)
            yield _referred(motion, name, force, at, place, stiff and force.frame in FOLLOWING, stiff)
            rest = rest - force.about(place)
    mass = [system.bodies[body].moments.mass for body in carried]
    centres = [
        motion.seen[f"bodies/{body}/position"] + motion.turned[body] @ system.bodies[body].moments.center_of_mass()
        for body in carried
    ]
    centre = place if not sum(mass) else np.einsum("b,bti->ti", mass, centres) / sum(mass)
    stiff = _stiffly(system, joint.child, name)
    wrench = np.hstack([_in(motion, name, rest[:, :3]), _in(motion, name, rest[:, 3:])])
    arm = _in(motion, name, centre - place) * stiff
    closed = any(force.held and force.body in carried for force in motion.pushes)
    inertia = _attached_inertia(motion, name, carried, place) * stiff
    yield AppliedLoad(
        f"inertia and weight of the bodies attached at {at!r}",
        at,
        wrench,
        wrench,
        arm,
        held=3 * (closed and held),
        inertia=inertia,
    )


def _attached_inertia(motion: RigidMotion, parent: str, carried: list[str], place: Array) -> Array:
    """Inertia (6, 6) of the bodies attached at a point of a parent, about that point, at the start, parent axes."""
    out = np.zeros((6, 6))
    for body in carried:
        moments = motion.system.bodies[body].moments
        C = motion.turned[parent][0].T @ motion.turned[body][0]
        c = C @ moments.center_of_mass()
        arm = motion.turned[parent][0].T @ (motion.seen[f"bodies/{body}/position"][0] - place[0])
        J = C @ moments.inertia() @ C.T - moments.mass * ((c @ c) * np.eye(3) - np.outer(c, c))
        S = skew(arm + c)
        out += np.block([[moments.mass * np.eye(3), -moments.mass * S], [moments.mass * S, J - moments.mass * S @ S]])
    return out


def _referred(
    motion: RigidMotion, name: str, force: AppliedForce, marker: str, place: Array, follows: bool, stiff: bool = False
) -> AppliedLoad:
    """An applied force, referred to a marker of the body."""
    wrench = force.about(place)
    wrench = np.hstack([_in(motion, name, wrench[:, :3]), _in(motion, name, wrench[:, 3:])])
    text = force.name if force.body == name else f"{force.name} on {force.body!r}"
    return AppliedLoad(text, marker, wrench, wrench, _in(motion, name, force.place - place) * stiff, follows)


def _field(motion: RigidMotion, name: str, total: Array) -> AppliedLoad:
    """The field of a body's inertia and weight, by what acts on it in all: force and torque (n_t, 6) about its origin.

    Force and torque are m (b + W c) and, about the centre of mass c, J alpha + omega x J omega; W = skew(alpha) +
    omega omega^T - omega^2 1. What has no inertia about an axis does not turn about it faster.
    """
    moments = motion.system.bodies[name].moments
    c, omega = moments.center_of_mass(), motion.seen[f"bodies/{name}/rate"]
    J = moments.inertia() - moments.mass * ((c @ c) * np.eye(3) - np.outer(c, c))
    torque = total[:, 3:] - np.cross(c, total[:, :3]) - np.cross(omega, omega @ J)
    alpha = torque @ np.linalg.pinv(J, rcond=1e-9, hermitian=True)
    W = omega[:, :, None] * omega[:, None, :] - np.einsum("ti,ti,jk->tjk", omega, omega, np.eye(3))
    W = W + np.cross(alpha[:, None, :], np.eye(3)).swapaxes(1, 2)
    b = total[:, :3] / moments.mass - W @ c
    values = np.hstack([b, W.swapaxes(1, 2).reshape(-1, 9)])
    return AppliedLoad(OWN, None, values, np.hstack([-total[:, :3], np.zeros_like(b)]))


def _about_origin(motion: RigidMotion, name: str, acting: list[AppliedForce]) -> Array:
    """Force and torque (n_t, 6) of all of them about a body's origin, its axes."""
    total = np.sum([force.about(motion.seen[f"bodies/{name}/position"]) for force in acting], axis=0)
    return np.hstack([_in(motion, name, total[:, :3]), _in(motion, name, total[:, 3:])])


def _in(motion: RigidMotion, name: str, vector: Array) -> Array:
    """(n_t, 3) in axes of a body."""
    return np.asarray(np.einsum("tji,tj->ti", motion.turned[name], vector))


def _stands_on(system: System, body: str | None, below: str) -> bool:
    """Whether a body is another one, or is carried by it."""
    while body is not None and body != below:
        body = system.joint_of(body).parent
    return body == below


def _stiffly(system: System, body: str | None, below: str | None) -> bool:
    """Whether no joint between a body and one that carries it, or the base frame, lets it turn."""
    while body is not None and body != below:
        joint = system.joint_of(body)
        if any(k not in joint.prescribed for k in range(len(joint.translations), joint.n_u)):
            return False
        body = joint.parent
    return True
