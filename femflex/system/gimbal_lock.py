"""Gimbal lock of joints that turn successively: where the axes of their free turns depend on each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.rotations import SINGULAR, dcm_from_vector

if TYPE_CHECKING:
    from femflex.system.joint import Joint


def free_turns(joint: Joint) -> list[int]:
    """Return the numbers of a joint's successive turns that are not prescribed; none for a ball."""
    return [k for k in range(len(joint.rotations)) if len(joint.translations) + k not in joint.prescribed]


def can_lock(joint: Joint) -> bool:
    """Whether the angle to gimbal lock changes along a motion: the first and the third turn are free."""
    return {0, 2} <= set(free_turns(joint))


def lock_angle(joint: Joint, q: Array) -> Array:
    """Angle (...) [rad] left to gimbal lock at the joint's coordinates q (..., n_q); pi/2 where nothing can lock.

    With three free turns that of the third axis to the plane of the first two, with two that between their axes. A turn
    leaves the angle to the axis after it as it is, so that only the second of three turns matters.
    """
    free, first = free_turns(joint), len(joint.translations)
    axes = [np.broadcast_to(axis, (*q.shape[:-1], 3)) for axis in joint.rotations]
    if len(axes) == 3:
        axes[2] = dcm_from_vector(joint.rotations[1] * q[..., first + 1, None]) @ joint.rotations[2]
    if len(free) < 2:
        return np.full(q.shape[:-1], np.pi / 2)
    normal = np.cross(axes[free[0]], axes[free[1]])
    length = np.linalg.norm(normal, axis=-1)
    if len(free) == 2:
        return np.arcsin(np.minimum(length, 1.0))
    out_of_plane = np.abs((normal * axes[2]).sum(-1)) / np.maximum(length, np.finfo(float).tiny)
    return np.where(length > SINGULAR, np.arcsin(np.minimum(out_of_plane, 1.0)), 0.0)


def lock_text(joint: Joint, q: Array) -> str:
    """Describe how close the free turns of a joint are to gimbal lock at its coordinates q (n_q,)."""
    names, free = joint.freedom_names()[len(joint.translations) :], free_turns(joint)
    text = ", ".join(repr(names[k]) for k in free)
    state = "in one plane" if len(free) == 3 else "parallel"
    angles = q[len(joint.translations) :][: len(joint.rotations)]
    values = ", ".join(f"{np.degrees(angle) + 0.0:.6g}" for angle in angles)
    angle_text = f"{float(lock_angle(joint, q)):.2g} rad"
    return f"the axes of its free turns {text} are {state} to {angle_text} (turns of {values} deg)"


def locked_start_text(joint: Joint) -> str | None:
    """Return the message that a joint of successive turns starts in gimbal lock, "" if it does not."""
    if float(lock_angle(joint, joint.q0)) > SINGULAR:
        return None
    return (
        f"joint {joint.label!r} starts in gimbal lock: {lock_text(joint, joint.q0)}; choose other axes or another "
        "sequence, let the joint be spherical with all turns free, or start elsewhere"
    )
