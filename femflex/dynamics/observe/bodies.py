"""Position, attitude and rate of every body, and the undeformed position of a body cut into segments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.observe.row import BODY, EULER, XYZ, origin_text, worded
from femflex.dynamics.report import Observation, Report, RowReport
from femflex.rotations import dcm_from_quaternion, dcm_from_vector, quaternion_from_dcm
from femflex.system import Channel, System


class Bodies(RowReport):
    """Channels of the bodies in the row, in tree order."""

    place = 1

    def channels(self, system: System) -> dict[str, Channel]:
        words = {"where": origin_text(system)}
        return {
            f"bodies/{name}/{key}": worded(
                channel, {**words, "name": name}, reported=key != "rate" or can_turn(system, name)
            )
            for name in system.order
            for key, channel in BODY.items()
        }


class Segmented(Report):
    """Position and attitude of every cut body: it sits where it is held, at the marker by which its joint holds it."""

    def channels(self, system: System) -> dict[str, Channel]:
        out, where = {}, origin_text(system)
        for name in system.segments:
            text = f"origin of {name}, undeformed, {where}"
            out[f"bodies/{name}/position"] = Channel("m", text, (3,), XYZ, "inertial")
            text = f"Euler parameters of {name}, undeformed, C_NB"
            out[f"bodies/{name}/attitude"] = Channel("1", text, (4,), EULER)
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        for segments in seen.system.segments.values():
            origin, C = undeformed_place(seen, segments)
            yield from (origin, quaternion_from_dcm(C))


def undeformed_place(seen: Observation, segments: Sequence[str]) -> tuple[Array, Array]:
    """Origin (n_t, 3) and C_NB (n_t, 3, 3) of the undeformed body that was cut into these segments."""
    system = seen.system
    first = next(s for s in segments if system.joint_of(s).parent not in segments)
    marker, delta = system.bodies[first].marker(system.joint_of(first).child_marker), seen[f"bodies/{first}/delta"]
    C = dcm_from_quaternion(seen[f"bodies/{first}/attitude"])
    arm = np.einsum("tij,tj->ti", C, marker.position + delta @ marker.phi.T)
    C = C @ dcm_from_vector(marker.rotation_vector(delta))
    return seen[f"bodies/{first}/position"] + arm - C @ marker.position, C


def can_turn(system: System, name: str) -> bool:
    """Whether a body can turn in inertial axes: by its frame, its joint, or the bodies that carry it."""
    joint = system.joint_of(name)
    if joint.ball is not None or len(joint.rotations) or system.bodies[name].marker(joint.child_marker).psi.any():
        return True
    if joint.parent is None:
        return system.frame.kind != "inertial"
    return bool(system.bodies[joint.parent].marker(joint.parent_marker).psi.any()) or can_turn(system, joint.parent)


def can_move(system: System, name: str) -> bool:
    """Whether the origin of a body can move in inertial axes."""
    joint = system.joint_of(name)
    if can_turn(system, name) or len(joint.translations) or name in system.varying:
        return True
    if system.bodies[name].marker(joint.child_marker).phi.any():
        return True
    if joint.parent is None:
        return False
    carrier = system.bodies[joint.parent].marker(joint.parent_marker)
    return bool(carrier.phi.any()) or joint.parent in system.varying or can_move(system, joint.parent)
