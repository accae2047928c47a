"""Channels of joints with successive turns: the angle that remains to gimbal lock."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.arrays import Array
from femflex.system import Channel, Joint, System
from femflex.system.gimbal_lock import can_lock, lock_angle


def lockable_joints(system: System) -> Iterator[tuple[Joint, int]]:
    """Return every joint of successive turns that can reach gimbal lock, and its first place in q."""
    first = 0
    for name in system.order:
        joint = system.joint_of(name)
        if can_lock(joint):
            yield joint, first
        first += joint.n_q + system.bodies[name].n_modes


def lock_channels(system: System) -> dict[str, Channel]:
    """Return path, unit and meaning of the channels."""
    return {
        f"joints/{joint.label}/singularity": Channel("rad", "angle left to gimbal lock of its free turns")
        for joint, _ in lockable_joints(system)
    }


def observe_locks(system: System, states: Array) -> dict[str, Array]:
    """The channels of `lock_channels` at states (n_t, n_x)."""
    return {
        f"joints/{joint.label}/singularity": lock_angle(joint, states[:, first : first + joint.n_q])
        for joint, first in lockable_joints(system)
    }
