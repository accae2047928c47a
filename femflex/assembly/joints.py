"""Build the joints of a case, and the joint of the root body that [attitude] defines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.body import Marker
from femflex.case import joint as tables
from femflex.case.case import Case
from femflex.case.joint_ball import Free, Spherical
from femflex.case.joint_base import JointTable
from femflex.case.joint_general import SLIDE_KEYS, TURN_KEYS, General
from femflex.case.orbit import AttitudeTable
from femflex.noun.problems import CaseError, Problem
from femflex.rotations import is_extrinsic, letters_of
from femflex.system import (
    Joint,
    Latch,
    Law,
    Part,
    Segments,
    Threshold,
    ball_coordinates,
    cylindrical,
    free,
    prismatic,
    revolute,
    spherical,
    turns,
    universal,
    weld,
)
from femflex.system.joint_coordinates import latch_start_problems

LIBRATION = "libration_axes"  # marker of the root body; the reported attitude is that of its axes


def build_joints(case: Case) -> list[Joint]:
    """The joints of a case. Raises CaseError with the problems of their prescribed motions."""
    problems, joints = [], []
    for k, table in enumerate(case.joints):
        try:
            joints.append(build_joint(table, case.path.parent))
        except ValueError as error:
            label = table.name or table.child or str(k)
            problems += [Problem(f"joints[{label}]", line) for line in str(error).splitlines()]
    if problems:
        raise CaseError(case.path.name, problems)
    return joints


def build_joint(table: JointTable, folder: Path) -> Joint:
    """The Joint of one entry of [[joints]] of a case in that folder. Raises ValueError."""
    joint = _with_motion(_free_joint(table), table, folder)
    latches = tuple(law for law in table.laws if isinstance(law, Latch))
    laws = tuple(law for law in table.laws if isinstance(law, Law))
    joint = _with_checked_latches(replace(joint, laws=laws, latches=latches) if table.laws else joint)
    trigger = table.release_at
    if table.release is None and trigger is None:
        return joint
    if joint.ball is not None or not joint.n_u or joint.prescribed or latches:
        raise ValueError(
            f"found release on a joint of kind {table.kind!r}; a release needs a joint of slides and single turns "
            "without prescribed motion and latches, such as kind = 'general'"
        )
    release = (
        table.release if trigger is None else Threshold(_channel_path(trigger.signal), trigger.above, trigger.below)
    )
    locks = tuple(Latch(coordinate=k, at=float(start), opens=release) for k, start in enumerate(joint.q0))
    return _with_checked_latches(replace(joint, latches=locks))


def _with_checked_latches(joint: Joint) -> Joint:
    """The joint itself. Raises ValueError if its latches do not fit its initial coordinates."""
    if problems := latch_start_problems(joint):
        raise ValueError("\n".join(problems))
    return joint


def _channel_path(signal: str) -> str:
    """The result channel of the signal "NAME.OUTPUT"."""
    return "effectors/" + signal.replace(".", "/", 1)


def _with_motion(joint: Joint, table: JointTable, folder: Path) -> Joint:
    """The joint with the prescribed motions of its table."""
    slides = table.motions("position") or (None,) * len(joint.translations)
    rotations = table.motions("angle") or table.motions("angles") or (None,) * (joint.n_u - len(joint.translations))
    motion = [
        None if m is None else float(joint.q0[k]) if m.locked else m.profile(folder) if m.profile else None
        for k, m in enumerate((*slides, *rotations))
    ]
    return replace(joint, motion=tuple(motion)) if any(m is not None for m in motion) else joint


def _free_joint(table: JointTable) -> Joint:
    """The joint of a table without prescribed motions."""
    ends: dict[str, Any] = table.model_dump(include={"child", "parent", "child_marker", "parent_marker", "name"})
    match table:
        case tables.Revolute():
            return revolute(axis=table.axis, q0=[table.angle], u0=[table.rate], **_springs(table), **ends)
        case tables.Prismatic():
            return prismatic(axis=table.axis, q0=[table.position], u0=[table.velocity], **_springs(table), **ends)
        case tables.Cylindrical():
            start: dict[str, Any] = {"q0": [table.position, table.angle], "u0": [table.velocity, table.rate]}
            return cylindrical(axis=table.axis, **start, **_springs(table, "slide_"), **ends)
        case tables.Universal():
            return universal(axes=table.axes, q0=table.angles, u0=table.rates, **_springs(table), **ends)
        case Spherical() if table.has_prescribed_angles:
            position, velocity = getattr(table, "position", ()), getattr(table, "velocity", ())
            start = {"q0": [*position, *table.angles], "u0": [*velocity, 0.0, 0.0, 0.0]}
            zero = np.zeros(3)
            springs: dict[str, Any] = {
                key: np.concatenate([getattr(table, f"slide_{key}"), zero]) if len(position) else zero
                for key in ("stiffness", "damping", "rest")
            }
            slides = np.eye(3)[: len(position)]
            return turns(sequence=table.sequence, slides=slides, **start, **springs, **ends)
        case Free():
            start = {"q0": [*table.position, *_ball_coordinates(table)], "u0": [*table.velocity, *table.rates]}
            return free(**_rotation_set(table), **start, **_springs(table, "slide_"), **ends)
        case Spherical():
            return spherical(
                **_rotation_set(table), q0=_ball_coordinates(table), u0=table.rates, **_springs(table), **ends
            )
        case General():
            values = {key: table.values_or_zeros(key) for key in (*SLIDE_KEYS, *TURN_KEYS)}
            numbers: dict[str, Any] = {
                key: np.array(values[f"slide_{key}"] + values[key]) for key in ("stiffness", "damping", "rest")
            }
            numbers["q0"] = np.array(values["position"] + values["angles"])
            numbers["u0"] = np.array(values["velocity"] + values["rates"])
            axes: dict[str, Any] = {"translations": np.array(table.slides), "rotations": np.array(table.turns)}
            return Joint(kind="general", **axes, **numbers, **ends)
    return weld(**ends)


def _springs(table: JointTable, prefix: str = "") -> dict[str, Any]:
    """Stiffness, damping and rest position of every quasi-coordinate; those with keys of that prefix come first."""
    keys = ("stiffness", "damping", "rest")
    values = {key: np.atleast_1d(getattr(table, key)) for key in keys}
    if prefix:
        return {key: np.concatenate([np.atleast_1d(getattr(table, prefix + key)), values[key]]) for key in keys}
    return values


def root_joint(case: Case, bodies: Mapping[str, Part]) -> tuple[Joint | None, dict[str, Part]]:
    """The joint of the root body, from [attitude], and the bodies with its libration marker.

    The joint is None if every body already has one.
    """
    jointed = {joint.child for joint in case.joints}
    without_joint = [name for name in bodies if name not in jointed]
    if not without_joint:
        return None, dict(bodies)
    name, attitude = case.attitude.root or without_joint[0], case.attitude
    axes = bodies[name].marker(attitude.marker or "origin")
    C_BM = axes.orientation if attitude.marker else nominal_axes(attitude)
    marker = attitude.marker or "origin"
    if not np.array_equal(C_BM, axes.orientation):
        marker = LIBRATION
    body = _with_marker(bodies[name], marker, axes.with_orientation(C_BM), attitude.marker or "origin")
    ends: dict[str, Any] = {"child": name, "child_marker": marker}
    rates = attitude.rates or (0.0, 0.0, 0.0)
    position, velocity = attitude.position or (0.0, 0.0, 0.0), attitude.velocity or (0.0, 0.0, 0.0)
    if attitude.held:
        joint = _prescribed_attitude_joint(attitude, position if case.orbit.kind == "free" else (), ends)
    elif case.orbit.kind != "specified":
        joint = free(
            **_rotation_set(attitude), q0=[*position, *_attitude_coordinates(attitude)], u0=[*velocity, *rates], **ends
        )
    else:
        joint = spherical(**_rotation_set(attitude), q0=_attitude_coordinates(attitude), u0=rates, **ends)
    return joint, {**bodies, name: body}


def _prescribed_attitude_joint(attitude: AttitudeTable, position: tuple[float, ...], ends: dict[str, Any]) -> Joint:
    """A joint with free translations and with the angles of the attitude's sequence, prescribed to be constant."""
    letters, angles = letters_of(attitude.sequence), attitude.turn_angles()
    if is_extrinsic(attitude.sequence):  # the same as the intrinsic turns in the other order
        letters, angles = letters[::-1], angles[::-1]
    motion = (*(None for _ in position), *angles)
    q0 = [*position, *angles]
    return turns(sequence=letters, slides=np.eye(3)[: len(position)], motion=motion, q0=q0, **ends)


def _attitude_coordinates(attitude: AttitudeTable) -> Array:
    """The initial coordinates of a free attitude, in its rotation set."""
    return ball_coordinates(attitude.rotation, attitude.sequence, np.array(attitude.turn_angles()), attitude.rebase)


def _with_marker(body: Part, name: str, marker: Marker, near_marker: str) -> Part:
    """A copy with one more marker; of a body cut into segments, on the segment that has the marker near_marker."""
    if isinstance(body, Segments):
        return body.with_marker(name, marker, near_marker)
    return replace(body, markers={**body.markers, name: marker})


def nominal_axes(attitude: AttitudeTable) -> Array:
    """C_BM (3, 3), direction cosines: its columns are the body axes along x0, y0, z0 in the nominal attitude."""
    columns = []
    for axis in attitude.nominal_axes or ("x", "y", "z"):
        columns.append(np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0))
    return np.stack(columns, axis=1)


def _ball_coordinates(table: Spherical) -> Array:
    return ball_coordinates(table.rotation, table.sequence, np.array(table.angles), table.rebase)


def _rotation_set(table: Spherical | AttitudeTable) -> dict[str, Any]:
    return {"rotation": table.rotation, "rebase": table.rebase}
