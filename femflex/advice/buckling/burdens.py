"""What bodies bear along a motion of rigid bodies: their own inertia and weight, loads, and what hangs on them.

What hangs on a marker hands on its own loads, apart from each other, and its inertia and weight, which are what is left
of the force and torque in the joint there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.advice.buckling.burden import Burden, skew
from femflex.advice.buckling.pushes import FOLLOWING, Motion, Push
from femflex.dynamics.model import compile_system
from femflex.system import Joint, System

Array = NDArray[np.float64]

OWN = "its own inertia and weight"


def burdens(system: System, names: Iterable[str], times: Array, states: Array) -> dict[str, list[Burden]]:
    """Of these bodies all that they bear, in their own axes.

    system: of rigid bodies that reports reactions; states (n_t, n_x) of its model at times (n_t,).
    """
    model = compile_system(system)
    motion = Motion(system, times, model.observe(times, states))
    return {name: list(_of(motion, name)) for name in names}


def _of(motion: Motion, name: str) -> Iterator[Burden]:
    """Burdens of a body."""
    system = motion.system
    acting = [motion.joint(name)]
    acting += [push for push in motion.pushes if push.body == name]
    held = _stiffly(system, name, None)
    for push in acting:
        one = _burden(motion, name, push, push.marker, push.place, push.load and push.frame == "marker")
        yield replace(one, held=push.held * held)
    total = _about_origin(motion, name, acting)
    for joint in system.joints:
        if joint.parent == name:
            hung = list(_hung(motion, joint, held))
            yield from hung
            arm = motion.place(name, joint.parent_marker) - motion.seen[f"bodies/{name}/position"]
            wrench = np.sum([burden.wrench for burden in hung], axis=0)
            total += np.hstack([wrench[:, :3], wrench[:, 3:] + np.cross(_in(motion, name, arm), wrench[:, :3])])
    yield _field(motion, name, total)


def _hung(motion: Motion, joint: Joint, held: bool) -> Iterator[Burden]:
    """What hangs at a joint's marker on its parent: the loads on it one by one, and its inertia and weight.

    held: whether loops that close over what hangs there hold the parent too.
    """
    assert joint.parent is not None
    system, name, at = motion.system, joint.parent, joint.parent_marker
    place = motion.place(name, at)
    carried = [body for body in system.order if _stands_on(system, body, joint.child)]
    rest = -motion.joint(joint.child).about(place)
    for push in motion.pushes:
        if push.load and push.body in carried:
            stiff = _stiffly(system, push.body, name)
            yield _burden(motion, name, push, at, place, stiff and push.frame in FOLLOWING, stiff)
            rest = rest - push.about(place)
    mass = [system.bodies[body].moments.mass for body in carried]
    centres = [
        motion.seen[f"bodies/{body}/position"] + motion.turned[body] @ system.bodies[body].moments.center_of_mass()
        for body in carried
    ]
    centre = place if not sum(mass) else np.einsum("b,bti->ti", mass, centres) / sum(mass)
    stiff = _stiffly(system, joint.child, name)
    wrench = np.hstack([_in(motion, name, rest[:, :3]), _in(motion, name, rest[:, 3:])])
    arm = _in(motion, name, centre - place) * stiff
    closed = any(push.held and push.body in carried for push in motion.pushes)
    inertia = _inertia_hung(motion, name, carried, place) * stiff
    yield Burden(f"what hangs at {at!r}", at, wrench, wrench, arm, held=3 * (closed and held), inertia=inertia)


def _inertia_hung(motion: Motion, parent: str, carried: list[str], place: Array) -> Array:
    """Inertia (6, 6) about a place on a parent of what hangs there, as it stands first, the parent's axes."""
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


def _burden(
    motion: Motion, name: str, push: Push, marker: str, place: Array, follows: bool, stiff: bool = False
) -> Burden:
    """A push as a body bears it at a marker of its own, at a place."""
    wrench = push.about(place)
    wrench = np.hstack([_in(motion, name, wrench[:, :3]), _in(motion, name, wrench[:, 3:])])
    told = push.name if push.body == name else f"{push.name} on {push.body!r}"
    return Burden(told, marker, wrench, wrench, _in(motion, name, push.place - place) * stiff, follows)


def _field(motion: Motion, name: str, total: Array) -> Burden:
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
    return Burden(OWN, None, values, np.hstack([-total[:, :3], np.zeros_like(b)]))


def _about_origin(motion: Motion, name: str, acting: list[Push]) -> Array:
    """Force and torque (n_t, 6) of all of them about a body's origin, its axes."""
    total = np.sum([push.about(motion.seen[f"bodies/{name}/position"]) for push in acting], axis=0)
    return np.hstack([_in(motion, name, total[:, :3]), _in(motion, name, total[:, 3:])])


def _in(motion: Motion, name: str, vector: Array) -> Array:
    """(n_t, 3) in axes of a body."""
    return np.asarray(np.einsum("tji,tj->ti", motion.turned[name], vector))


def _stands_on(system: System, body: str | None, below: str) -> bool:
    """Whether a body is another, or hangs on it."""
    while body is not None and body != below:
        body = system.joint_of(body).parent
    return body == below


def _stiffly(system: System, body: str | None, below: str | None) -> bool:
    """Whether no joint between a body and one that it hangs on, or the base frame, lets it turn."""
    while body is not None and body != below:
        joint = system.joint_of(body)
        if any(k not in joint.held for k in range(len(joint.translations), joint.n_u)):
            return False
        body = joint.parent
    return True
