"""Laws and latches of joints, and their places in the state."""

from __future__ import annotations

from dataclasses import dataclass

from femflex.dynamics.joints.places import joint_places
from femflex.system import Joint, JointLaw, Latch, System
from femflex.system.joint_coordinates import OPEN

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
