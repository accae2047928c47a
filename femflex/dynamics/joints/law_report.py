"""Channels of laws and latches of joints: state numbers, times of locking, and the power that is dissipated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.system import Channel, Effector, Joint, JointLaw, Latch, System
from femflex.system.joint_coordinates import OPEN

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


FORCES = {"m/s": "N", "rad/s": "N m"}


@dataclass(frozen=True, eq=False)
class LawPlace:
    """A law, or an elastic latch, and its places in q, in u, and in z (-1: none)."""

    name: str
    joint: Joint
    law: JointLaw
    q: int
    u: int
    time: int

    @property
    def unit(self) -> str:
        """Unit of its force."""
        return FORCES[self.joint.velocity_names()[self.law.freedom][1]]


def law_places(system: System) -> list[LawPlace]:
    """Every law in the order of the model's: per joint its laws, then its elastic latches."""
    places, iq, iu, iz = [], 0, 0, 0
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        for law_name, law in zip(joint.law_names(), joint.laws, strict=True):
            places.append(LawPlace(law_name, joint, law, iq + law.freedom, iu + law.freedom, -1))
        for latch in joint.latches:
            if not latch.rigid:
                label = joint.freedom_names()[latch.freedom] + ".latch"
                places.append(LawPlace(label, joint, latch, iq + latch.freedom, iu + latch.freedom, iz))
            iz += len(OPEN)
        iq, iu = iq + joint.n_q + n, iu + joint.n_u + n
    return places


@dataclass(frozen=True, eq=False)
class LatchPlace:
    """A latch, and the places of its coordinate in q, its freedom in u, and its time in z, with its loss next to it."""

    joint: Joint
    latch: Latch
    q: int
    u: int
    time: int


def latch_places(system: System) -> list[LatchPlace]:
    """Every latch, per body in tree order."""
    places: list[LatchPlace] = []
    iq = iu = 0
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        for latch in joint.latches:
            k = latch.freedom
            places.append(LatchPlace(joint, latch, iq + k, iu + k, len(OPEN) * len(places)))
        iq, iu = iq + joint.n_q + n, iu + joint.n_u + n
    return places


def is_damped(system: System) -> bool:
    """Return whether any element dissipates energy of the motion."""
    joints = any(joint.damping.any() or joint.laws or joint.latches for joint in system.joints)
    joints = joints or any(spring.damping for spring in system.springs)
    joints = joints or any(isinstance(e, Effector) and "dissipation" in e.accounts for e in system.effectors)
    return joints or any(body.damping.any() for body in system.bodies.values())


def law_channels(system: System) -> dict[str, Channel]:
    """Return path, unit and meaning of the channels of latches, and of the dissipated power."""
    out = {}
    for latch_place in latch_places(system):
        name = latch_place.joint.freedom_names()[latch_place.latch.freedom]
        path = f"latches/{name}"
        out[f"{path}/locked"] = Channel("1", f"1 from when {name} latched")
        out[f"{path}/time"] = Channel("s", f"when {name} latched; -1 before; -2 - t once released at t")
        out[f"{path}/loss"] = Channel("J", f"energy lost when {name} latched")
    if is_damped(system):
        out["monitors/dissipation"] = Channel("W", "power taken by dampers, friction, stops and structural damping")
    return out


def observe_laws(model: Model, states: Array, dissipated: Array) -> dict[str, Array]:
    """The channels of `law_channels` at states (n_t, n_x), where force terms take the power `taken` (n_t,) [W]."""
    system, (_, u, z) = model.system, model.parts(states)
    if not is_damped(system):
        return {}
    out: dict[str, Array] = {}
    for latch_place in latch_places(system):
        path = f"latches/{latch_place.joint.freedom_names()[latch_place.latch.freedom]}"
        out[f"{path}/time"], out[f"{path}/loss"] = z[:, latch_place.time], z[:, latch_place.time + 1]
        out[f"{path}/locked"] = (z[:, latch_place.time] >= 0).astype(float)
    return {**out, "monitors/dissipation": linear_dissipation(system, u) + dissipated}


def linear_dissipation(system: System, u: Array) -> Array:
    """Power (n_t,) that linear dampers of joints and bodies take at quasi-velocities (n_t, n_u) [W]."""
    power, first = np.zeros(len(u)), 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        power += u[:, first : first + joint.n_u] ** 2 @ joint.damping
        first += joint.n_u
        ddelta = u[:, first : first + body.n_modes]
        power += np.einsum("ti,ij,tj->t", ddelta, body.damping, ddelta)
        first += body.n_modes
    return power
