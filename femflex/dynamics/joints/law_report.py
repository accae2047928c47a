"""Channels of the laws and latches of joints: forces, what they take out of the motion, and when latches locked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.system import Channel, Joint, Latch, Law, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

Array = NDArray[np.float64]

FORCES = {"m/s": "N", "rad/s": "N m"}


@dataclass(frozen=True, eq=False)
class LawPlace:
    """A law, or an elastic latch, and where what it needs stands in the state (q, u)."""

    name: str
    joint: Joint
    of: Law | Latch
    q: int
    u: int
    time: int

    @property
    def unit(self) -> str:
        """Unit of its force."""
        return FORCES[self.joint.velocity_names()[self.of.freedom][1]]


def law_places(system: System) -> list[LawPlace]:
    """Every law in the order of the model's: per joint its laws, then its elastic latches."""
    found, iq, iu = [], 0, 0
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        for law_name, law in zip(joint.law_names(), joint.laws, strict=True):
            found.append(LawPlace(law_name, joint, law, iq + law.freedom, iu + law.freedom, -1))
        for latch, place in zip(joint.latches, joint.latch_places(), strict=True):
            if not latch.rigid:
                label = joint.freedom_names()[latch.freedom] + ".latch"
                found.append(LawPlace(label, joint, latch, iq + latch.freedom, iu + latch.freedom, iq + place))
        iq, iu = iq + joint.n_q + n, iu + joint.n_u + n
    return found


def latch_places(system: System) -> list[tuple[Joint, Latch, int, int]]:
    """(joint, latch, place of its time in q, place of its freedom in u) of every latch."""
    found, iq, iu = [], 0, 0
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        for latch, place in zip(joint.latches, joint.latch_places(), strict=True):
            found.append((joint, latch, iq + place, iu + latch.freedom))
        iq, iu = iq + joint.n_q + n, iu + joint.n_u + n
    return found


def is_damped(system: System) -> bool:
    """Whether anything takes energy out of the motion for good."""
    joints = any(joint.damping.any() or joint.laws or joint.latches for joint in system.joints)
    return joints or any(body.damping.any() for body in system.bodies.values())


def law_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of what is reported of laws and latches."""
    out = {
        f"laws/{place.name}/force": Channel(place.unit, f"what {place.name} resists with")
        for place in law_places(system)
    }
    for joint, latch, _, _ in latch_places(system):
        name = joint.freedom_names()[latch.freedom]
        path = f"latches/{name}"
        out[f"{path}/locked"] = Channel("1", f"1 from when {name} latched")
        out[f"{path}/time"] = Channel("s", f"when {name} latched; -1 before")
        out[f"{path}/loss"] = Channel("J", f"energy lost when {name} latched")
    if is_damped(system):
        out["monitors/dissipation"] = Channel("W", "power taken by dampers, friction, stops and structural damping")
    return out


def observe_laws(model: Model, states: Array) -> dict[str, Array]:
    """The channels of `law_channels` at states (n_t, n_x)."""
    system, q, u = model.system, states[:, : model.n_q], states[:, model.n_q :]
    if not is_damped(system):
        return {}
    out: dict[str, Array] = {}
    power = linear_dissipation(system, u)
    for place in law_places(system):
        x, rate = q[:, place.q], u[:, place.u]
        if isinstance(place.of, Law):
            force, taken = place.of.force(x, rate), place.of.power(x, rate)
        else:
            locked = q[:, place.time] >= 0
            force = locked * (place.of.stiffness * (x - place.of.at) + place.of.damping * rate)
            taken = locked * place.of.damping * rate**2
        out[f"laws/{place.name}/force"] = force
        power = power + taken
    for joint, latch, at, _ in latch_places(system):
        path = f"latches/{joint.freedom_names()[latch.freedom]}"
        out[f"{path}/time"], out[f"{path}/loss"] = q[:, at], q[:, at + 1]
        out[f"{path}/locked"] = (q[:, at] >= 0).astype(float)
    return {**out, "monitors/dissipation": power}


def linear_dissipation(system: System, u: Array) -> Array:
    """Power (n_t,) that linear dampers of joints and bodies take at quasi-velocities (n_t, n_u) [W]."""
    power, at = np.zeros(len(u)), 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        power += u[:, at : at + joint.n_u] ** 2 @ joint.damping
        at += joint.n_u
        ddelta = u[:, at : at + body.n_modes]
        power += np.einsum("ti,ij,tj->t", ddelta, body.damping, ddelta)
        at += body.n_modes
    return power
