"""What a run reports of joints that turn freely: the angle left to the singularity of their rotation set."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.arrays import Array, IntArray
from femflex.dynamics.lowering.layout import W_NEAR, body_records
from femflex.rotations import (
    EULER_PARAMETERS,
    coordinates_from_dcm,
    dcm_from_coordinates,
    dcm_from_quaternion,
    singularity_distance,
)
from femflex.system import Channel, Joint, System
from femflex.system.ball import ball_names


def balls(system: System) -> Iterator[tuple[Joint, str, int]]:
    """Every ball whose rotation set has a singularity: its joint, its set, and where its coordinates stand in q."""
    at = 0
    for name in system.order:
        joint = system.joint_of(name)
        if joint.ball is not None and joint.ball != EULER_PARAMETERS:
            yield joint, joint.ball, at + joint.ball_places().start
        at += joint.n_q + system.bodies[name].n_modes


def singularity_notes(system: System, table: IntArray) -> dict[str, int]:
    """Where in the work array the steps note how near a ball came to its singularity, and when, by its channel."""
    blocks = {name: int(b["work"]) + W_NEAR for name, b in zip(system.order, body_records(table)[1:], strict=True)}
    return {f"joints/{joint.label}/singularity": blocks[joint.child] for joint, _, _ in balls(system)}


def ball_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of what is reported of balls."""
    out = {}
    for joint, rotation, _ in balls(system):
        path = f"joints/{joint.label}"
        out[f"{path}/singularity"] = Channel("rad", f"angle to the singularity of {rotation}")
        if joint.rebase:
            names, units = zip(*ball_names(rotation), strict=True)
            text = f"{rotation} from the parent's marker, independent of the reference of q"
            out[f"{path}/rotation"] = Channel(units[0], text, (3,), names)
    return out


def observe_balls(system: System, states: Array) -> dict[str, Array]:
    """The channels of `ball_channels` at states (n_t, n_x)."""
    out = {}
    for joint, rotation, first in balls(system):
        q, path = states[:, first : first + 3], f"joints/{joint.label}"
        out[f"{path}/singularity"] = singularity_distance(q, rotation)
        if joint.rebase:
            C_PR = dcm_from_quaternion(states[:, first + 3 : first + 7])
            out[f"{path}/rotation"] = coordinates_from_dcm(C_PR @ dcm_from_coordinates(q, rotation), rotation)
    return out
