"""Channels of the motion of joints: slides, turns and their rates; for free rotations the rotation and the angle that
remains to the singularity of the rotation set.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.lowering.layout import W_NEAR, body_records
from femflex.rotations import (
    EULER_PARAMETERS,
    coordinates_from_dcm,
    dcm_from_coordinates,
    dcm_from_quaternion,
    dcm_from_vector,
    singularity_distance,
)
from femflex.system import Channel, Joint, System


def joint_places(system: System) -> Iterator[tuple[Joint, int, int]]:
    """Return every joint with the first places of its coordinates in q and of its quasi-velocities in u."""
    iq = iu = 0
    for name in system.order:
        joint, n = system.joint_of(name), system.bodies[name].n_modes
        yield joint, iq, iu
        iq, iu = iq + joint.n_q + n, iu + joint.n_u + n


def has_singularity(joint: Joint) -> bool:
    """Whether a joint is a ball whose rotation set has a singularity."""
    return joint.ball is not None and joint.ball != EULER_PARAMETERS


def is_reported(joint: Joint) -> bool:
    """Whether the motion of a joint is reported; that of a free body in the base frame is the body's own."""
    return joint.n_u > 0 and (joint.parent is not None or joint.ball is None)


def singularity_notes(system: System, table: IntArray) -> dict[str, int]:
    """Return by channel where in the work array steps note how near a ball came to its singularity, and when."""
    blocks = {name: int(b["work"]) + W_NEAR for name, b in zip(system.order, body_records(table)[1:], strict=True)}
    balls = [joint for joint in map(system.joint_of, system.order) if has_singularity(joint)]
    return {f"joints/{joint.label}/singularity": blocks[joint.child] for joint in balls}


def joint_channels(system: System) -> dict[str, Channel]:
    """Return path, unit and meaning of the channels of the joints' motion."""
    out = {}
    for joint, _, _ in joint_places(system):
        path, short = f"joints/{joint.label}", joint.label + "."
        names = [(name.removeprefix(short), unit) for name, unit in joint.coordinate_names()]
        if is_reported(joint):
            n = len(joint.translations)
            turns = [] if joint.ball is not None else names[n:]
            for key, part, what in (("slide", names[:n], "slide"), ("angle", turns, "angle of turn")):
                if part:
                    out[f"{path}/{key}"] = _channel(part, f"{what} of joint {joint.label}")
            rates = [(name.removeprefix(short), unit) for name, unit in joint.velocity_names()]
            of_ball = (
                ""
                if joint.ball is None
                else f"; omega relative to the parent, in axes of {joint.child}.{joint.child_marker}"
            )
            out[f"{path}/rate"] = _channel(rates, f"rate of joint {joint.label}{of_ball}")
        if joint.ball is not None and (joint.rebase or is_reported(joint)):
            of_set = names[joint.ball_slice()]
            text = f"{joint.ball} from the parent's marker"
            text += ", independent of the reference of q" if joint.rebase else ""
            out[f"{path}/rotation"] = _channel(of_set, text)
        if has_singularity(joint):
            out[f"{path}/singularity"] = Channel("rad", f"angle to the singularity of {joint.ball}")
    return out


def observe_joints(system: System, states: Array, n_q: int) -> dict[str, Array]:
    """The channels of `joint_channels` at states (n_t, n_x), of which the first n_q columns are coordinates."""
    out: dict[str, Array] = {}
    for joint, iq, iu in joint_places(system):
        q, u = states[:, iq : iq + joint.n_q], states[:, n_q + iu : n_q + iu + joint.n_u]
        path, n = f"joints/{joint.label}", len(joint.translations)
        for key, values in (("slide", q[:, :n]), ("angle", q[:, n:]), ("rate", u)):
            out[f"{path}/{key}"] = values[:, 0] if values.shape[1] == 1 else values
        if joint.ball is not None:
            ball = q[:, joint.ball_slice()]
            if has_singularity(joint):
                out[f"{path}/singularity"] = singularity_distance(ball, joint.ball)
            if joint.rebase:
                C_PR = dcm_from_quaternion(q[:, n + 3 : n + 7])
                ball = coordinates_from_dcm(C_PR @ dcm_from_coordinates(ball, joint.ball), joint.ball)
            out[f"{path}/rotation"] = ball
    return out


def _channel(parts: list[tuple[str, str]], text: str) -> Channel:
    """A channel of named parts with their units; of a single part a scalar."""
    names, units = zip(*parts, strict=True)
    if len(parts) == 1:
        return Channel(units[0], text)
    unit = units[0] if len(set(units)) == 1 else ", ".join(units)
    return Channel(unit, text, (len(parts),), names)


def rest_coordinates(joint: Joint) -> Array:
    """Return coordinates (n_q,) at which the springs of a joint are free; initial ones where there is no spring."""
    q, n = joint.q0.copy(), len(joint.translations)
    sprung = joint.stiffness > 0
    if joint.ball is None:
        return np.where(sprung, joint.rest, q)
    q[:n] = np.where(sprung[:n], joint.rest[:n], q[:n])
    if sprung[n:].any():
        C_PQ = dcm_from_vector(joint.rest[n:])
        C_PR = dcm_from_quaternion(q[-4:]) if joint.rebase else np.eye(3)
        q[joint.ball_slice()] = coordinates_from_dcm(C_PR.T @ C_PQ, joint.ball)
    return q
