"""Forces and torques of joints and loops in the joint's own axes: those of the child's marker, turned as the child's
shapes turn it. A component along the axis of a hinge is its torque; the others are bending moments of the child's root.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.reactions import joints_with_reactions
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.system import Channel, Joint, System

XYZ = ("x", "y", "z")


def joints_with_local_forces(system: System) -> dict[str, Joint]:
    """The joints whose force and torque are reported, by the first parts of their channels' paths."""
    joints = {f"joints/{joint.label}": joint for joint in (joints_with_reactions(system) if system.reactions else [])}
    return joints | {f"loops/{loop.label}": loop for loop in system.loops}


def local_force_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of forces and torques in axes of joints."""
    out = {}
    for path, joint in joints_with_local_forces(system).items():
        where = f"{joint.child}.{joint.child_marker}"
        for key, unit in (("force", "N"), ("torque", "N m")):
            out[f"{path}/local_{key}"] = Channel(
                unit, f"{key} on {joint.child} in axes of {where}", (3,), XYZ, "marker"
            )
    return out


def observe_local_forces(system: System, times: Array, channels: Mapping[str, Array]) -> dict[str, Array]:
    """The channels of `local_force_channels` at times (n_t,), from the inertial components."""
    out = {}
    for path, joint in joints_with_local_forces(system).items():
        C_NM = marker_motion(system, times, channels, joint.child, joint.child_marker)[1]
        for key in ("force", "torque"):
            out[f"{path}/local_{key}"] = np.einsum("tij,ti->tj", C_NM, channels[f"{path}/{key}"])
    return out
