"""Joints of a case, and the root body's joint that [attitude] stands for."""

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
from femflex.case.law import read_laws
from femflex.case.orbit import AttitudeTable
from femflex.case.problems import CaseError, Problem
from femflex.rotations import is_extrinsic, letters_of
from femflex.system import (
    Joint,
    Latch,
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

LIBRATION = "libration_axes"  # marker of the root body whose axes the attitude is reported of


def build_joints(case: Case) -> list[Joint]:
    """The joints of a case. Raises CaseError with what is wrong with their motions."""
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
    joint = _with_motion(_loose_joint(table), table, folder)
    laws, latches = read_laws(table.laws, table.coordinates())
    joint = _started(replace(joint, laws=laws, latches=latches) if laws or latches else joint)
    at = table.release_at
    if table.release is None and at is None:
        return joint
    if joint.ball is not None or not joint.n_u or joint.prescribed or latches:
        raise ValueError(
            f"found release on a joint of kind {table.kind!r}; a release needs a joint of slides and single turns "
            "without prescribed motion and latches, such as kind = 'general'"
        )
    opens = table.release if at is None else Threshold(_path(at.signal), at.above, at.below)
    locks = tuple(Latch(k, float(start), opens=opens) for k, start in enumerate(joint.q0))
    return _started(replace(joint, latches=locks))


def _started(joint: Joint) -> Joint:
    """The joint, whose latches fit its initial coordinates. Raises ValueError."""
    if problems := latch_start_problems(joint):
        raise ValueError("\n".join(problems))
    return joint


def _path(signal: str) -> str:
    """Channel of the signal "NAME.OUTPUT"."""
    return "effectors/" + signal.replace(".", "/", 1)


def _with_motion(joint: Joint, table: JointTable, folder: Path) -> Joint:
    """The joint with the motions that its table specifies."""
    slides = table.motions("position") or (None,) * len(joint.translations)
    turns_ = table.motions("angle") or table.motions("angles") or (None,) * (joint.n_u - len(joint.translations))
    motion = [
        None if m is None else float(joint.q0[k]) if m.locked else m.profile(folder) if m.profile else None
        for k, m in enumerate((*slides, *turns_))
    ]
    return replace(joint, motion=tuple(motion)) if any(m is not None for m in motion) else joint


def _loose_joint(table: JointTable) -> Joint:
    """The joint with all its freedoms free."""
    where: dict[str, Any] = table.model_dump(include={"child", "parent", "child_marker", "parent_marker", "name"})
    match table:
        case tables.Revolute():
            return revolute(axis=table.axis, q0=[table.angle], u0=[table.rate], **_springs(table), **where)
        case tables.Prismatic():
            return prismatic(axis=table.axis, q0=[table.position], u0=[table.velocity], **_springs(table), **where)
        case tables.Cylindrical():
            start: dict[str, Any] = {"q0": [table.position, table.angle], "u0": [table.velocity, table.rate]}
            return cylindrical(axis=table.axis, **start, **_springs(table, "slide_"), **where)
        case tables.Universal():
            return universal(axes=table.axes, q0=table.angles, u0=table.rates, **_springs(table), **where)
        case Spherical() if table.has_prescribed_angles:
            position, velocity = getattr(table, "position", ()), getattr(table, "velocity", ())
            start = {"q0": [*position, *table.angles], "u0": [*velocity, 0.0, 0.0, 0.0]}
            zero = np.zeros(3)
            springs: dict[str, Any] = {
                key: np.concatenate([getattr(table, f"slide_{key}"), zero]) if len(position) else zero
                for key in ("stiffness", "damping", "rest")
            }
            slides = np.eye(3)[: len(position)]
            return turns(sequence=table.sequence, slides=slides, **start, **springs, **where)
        case Free():
            start = {"q0": [*table.position, *_ball(table)], "u0": [*table.velocity, *table.rates]}
            return free(**_set(table), **start, **_springs(table, "slide_"), **where)
        case Spherical():
            return spherical(**_set(table), q0=_ball(table), u0=table.rates, **_springs(table), **where)
        case General():
            values = {key: table.values_or_zeros(key) for key in (*SLIDE_KEYS, *TURN_KEYS)}
            numbers: dict[str, Any] = {
                key: np.array(values[f"slide_{key}"] + values[key]) for key in ("stiffness", "damping", "rest")
            }
            numbers["q0"] = np.array(values["position"] + values["angles"])
            numbers["u0"] = np.array(values["velocity"] + values["rates"])
            axes: dict[str, Any] = {"translations": np.array(table.slides), "rotations": np.array(table.turns)}
            return Joint(kind="general", **axes, **numbers, **where)
    return weld(**where)


def _springs(table: JointTable, first: str = "") -> dict[str, Any]:
    """Stiffness, damping and rest of every quasi-coordinate; those whose keys begin with `first` come before."""
    keys = ("stiffness", "damping", "rest")
    found = {key: np.atleast_1d(getattr(table, key)) for key in keys}
    if first:
        return {key: np.concatenate([np.atleast_1d(getattr(table, first + key)), found[key]]) for key in keys}
    return found


def root_joint(case: Case, bodies: Mapping[str, Part]) -> tuple[Joint | None, dict[str, Part]]:
    """The joint of the root body, from [attitude], and the bodies with its libration marker.

    None when every body already has a joint.
    """
    hung = {joint.child for joint in case.joints}
    loose = [name for name in bodies if name not in hung]
    if not loose:
        return None, dict(bodies)
    name, attitude = case.attitude.root or loose[0], case.attitude
    place = bodies[name].marker(attitude.marker or "origin")
    C_BM = place.orientation if attitude.marker else nominal_axes(attitude)
    marker = attitude.marker or "origin"
    if not np.array_equal(C_BM, place.orientation):
        marker = LIBRATION
    body = _with_marker(bodies[name], marker, place.with_orientation(C_BM), attitude.marker or "origin")
    where: dict[str, Any] = {"child": name, "child_marker": marker}
    rates = attitude.rates or (0.0, 0.0, 0.0)
    position, velocity = attitude.position or (0.0, 0.0, 0.0), attitude.velocity or (0.0, 0.0, 0.0)
    if attitude.held:
        joint = _held(attitude, position if case.orbit.kind == "free" else (), where)
    elif case.orbit.kind != "specified":
        joint = free(**_set(attitude), q0=[*position, *_turned(attitude)], u0=[*velocity, *rates], **where)
    else:
        joint = spherical(**_set(attitude), q0=_turned(attitude), u0=rates, **where)
    return joint, {**bodies, name: body}


def _held(attitude: AttitudeTable, position: tuple[float, ...], where: dict[str, Any]) -> Joint:
    """Turns by the angles of the attitude's sequence, prescribed to stay as they are, after slides that are free."""
    letters, angles = letters_of(attitude.sequence), attitude.turn_angles()
    if is_extrinsic(attitude.sequence):  # the same as the intrinsic turns in the other order
        letters, angles = letters[::-1], angles[::-1]
    motion = (*(None for _ in position), *angles)
    q0 = [*position, *angles]
    return turns(sequence=letters, slides=np.eye(3)[: len(position)], motion=motion, q0=q0, **where)


def _turned(attitude: AttitudeTable) -> Array:
    """Initial coordinates of an attitude that is free, in its rotation set."""
    return ball_coordinates(attitude.rotation, attitude.sequence, np.array(attitude.turn_angles()), attitude.rebase)


def _with_marker(body: Part, name: str, marker: Marker, near_marker: str) -> Part:
    """A copy with a marker; of a body cut into segments it is on the segment that holds the marker near_marker."""
    if isinstance(body, Segments):
        return body.with_marker(name, marker, near_marker)
    return replace(body, markers={**body.markers, name: marker})


def nominal_axes(attitude: AttitudeTable) -> Array:
    """C_BM (3, 3), direction cosines: the body axes along x0, y0, z0 in the nominal attitude are its columns."""
    columns = []
    for axis in attitude.nominal_axes or ("x", "y", "z"):
        columns.append(np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0))
    return np.stack(columns, axis=1)


def _ball(table: Spherical) -> Array:
    return ball_coordinates(table.rotation, table.sequence, np.array(table.angles), table.rebase)


def _set(table: Spherical | AttitudeTable) -> dict[str, Any]:
    return {"rotation": table.rotation, "rebase": table.rebase}
