"""Places of joints, prescribed freedoms, laws and latches in the state, and of notes how near singularities came."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody
from femflex.dynamics.layout.records import W_NEAR, body_records
from femflex.rotations import EULER_PARAMETERS
from femflex.system import Joint, JointLaw, Latch, System
from femflex.system.joint_coordinates import OPEN

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


class BodyPlace(NamedTuple):
    """A body and its joint: first places of the joint's coordinates in q, of its quasi-velocities in u, of shapes."""

    name: str
    joint: Joint
    body: FlexibleBody
    q: int
    u: int

    @property
    def shapes_q(self) -> IntArray:
        """Places of its elastic coordinates in q."""
        return self.q + self.joint.n_q + np.arange(self.body.n_modes)

    @property
    def shapes_u(self) -> IntArray:
        """Places of their rates in u."""
        return self.u + self.joint.n_u + np.arange(self.body.n_modes)


def body_places(system: System) -> Iterator[BodyPlace]:
    """The bodies in tree order."""
    q = u = 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        yield BodyPlace(name, joint, body, q, u)
        q, u = q + joint.n_q + body.n_modes, u + joint.n_u + body.n_modes


def joint_places(system: System) -> Iterator[tuple[Joint, int, int]]:
    """Return every joint with the first places of its coordinates in q and of its quasi-velocities in u."""
    return ((place.joint, place.q, place.u) for place in body_places(system))


def has_singularity(joint: Joint) -> bool:
    """Whether a joint is a ball whose rotation set has a singularity."""
    return joint.ball is not None and joint.ball != EULER_PARAMETERS


def singularity_notes(system: System, table: IntArray) -> dict[str, int]:
    """Return by channel where in the work array steps note how near a ball came to its singularity, and when."""
    blocks = {name: int(b["work"]) + W_NEAR for name, b in zip(system.order, body_records(table)[1:], strict=True)}
    balls = [joint for joint in map(system.joint_of, system.order) if has_singularity(joint)]
    return {f"joints/{joint.label}/singularity": blocks[joint.child] for joint in balls}


def prescribed_freedoms(joint: Joint) -> list[int]:
    """Return the freedoms of a joint that are prescribed throughout or once they latch, in the model's order."""
    return [*joint.prescribed, *(latch.freedom for latch in joint.locking)]


def prescribed_places(system: System) -> list[tuple[Joint, int, int, int]]:
    """Return (joint, its freedom, place in q, place in u) of every freedom that is or may become prescribed."""
    return [(joint, k, iq + k, iu + k) for joint, iq, iu in joint_places(system) for k in prescribed_freedoms(joint)]


def prescribed_states(model: Model, times: Array, states: Array) -> Array:
    """Return the states (n_t, n_x) with prescribed freedoms at their prescribed values."""
    places = [entry for entry in prescribed_places(model.system) if entry[1] in entry[0].prescribed]
    if not places:
        return states
    states = states.copy()
    for joint, k, q, u in places:
        states[:, q], states[:, model.n_q + u], _ = joint.prescribed[k](times)
    return states


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
    places, iz = [], 0
    for joint, iq, iu in joint_places(system):
        for law_name, law in zip(joint.law_names(), joint.laws, strict=True):
            places.append(LawPlace(law_name, joint, law, iq + law.freedom, iu + law.freedom, -1))
        for latch in joint.latches:
            if not latch.rigid:
                label = joint.freedom_names()[latch.freedom] + ".latch"
                places.append(LawPlace(label, joint, latch, iq + latch.freedom, iu + latch.freedom, iz))
            iz += len(OPEN)
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
    for joint, iq, iu in joint_places(system):
        for latch in joint.latches:
            k = latch.freedom
            places.append(LatchPlace(joint, latch, iq + k, iu + k, len(OPEN) * len(places)))
    return places
