"""Build the joints and loops of a case, and the joint of the root body that [attitude] defines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.body import Marker
from femflex.case.attitude import AttitudeTable
from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem, quoted_names
from femflex.rotations import is_extrinsic, letters_of
from femflex.system import Joint, Part, Segments, ball_coordinates, free, spherical, turns
from femflex.system.followed_attitude import followed_angles

CUT_JOINT_KEYS = {"kind", "child", "parent", "child_marker", "parent_marker", "name", "axis", "axes", "play"}
LIBRATION = "libration_axes"  # marker of the root body; the reported attitude is that of its axes


def build_joints(case: Case) -> list[Joint]:
    """The joints of a case. Raises CaseError with the problems of their prescribed motions."""
    problems, joints = [], []
    for k, table in enumerate(case.joints):
        try:
            joints.append(table.joint(case.path.parent))
        except ValueError as error:
            label = table.name or table.child or str(k)
            problems += [Problem(f"joints[{label}]", line) for line in str(error).splitlines()]
    if problems:
        raise CaseError(case.path.name, problems)
    return joints


def build_loops(case: Case) -> tuple[Joint, ...]:
    """The cut joints of [[loops]]. Raises CaseError for keys that a cut joint does not have."""
    problems = []
    for table in case.loops:
        extra = sorted(table.model_fields_set - CUT_JOINT_KEYS)
        if extra:
            where = f"loops[{table.name or table.child}].{extra[0]}"
            text = (
                f"found {quoted_names(extra)}; a loop has no coordinates of its own. Set them on a joint of "
                "[[joints]], or cut the loop elsewhere"
            )
            problems.append(Problem(where, text))
    if problems:
        raise CaseError(case.path.name, problems)
    return tuple(table.joint(case.path.parent) for table in case.loops)


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
    ball: dict[str, Any] = {"rotation": attitude.rotation, "rebase": attitude.rebase, **ends}
    if attitude.ephemeris is not None:
        joint = _followed_attitude_joint(case, C_BM, position if case.orbit.kind == "free" else (), ends)
    elif attitude.held:
        joint = _prescribed_attitude_joint(attitude, position if case.orbit.kind == "free" else (), ends)
    elif case.orbit.kind != "specified":
        joint = free(q0=[*position, *_attitude_coordinates(attitude)], u0=[*velocity, *rates], **ball)
    else:
        joint = spherical(q0=_attitude_coordinates(attitude), u0=rates, **ball)
    return joint, {**bodies, name: body}


def _prescribed_attitude_joint(attitude: AttitudeTable, position: tuple[float, ...], ends: dict[str, Any]) -> Joint:
    """A joint with free translations and with the angles of the attitude's sequence, prescribed to be constant."""
    letters, angles = letters_of(attitude.sequence), attitude.turn_angles()
    if is_extrinsic(attitude.sequence):  # the same as the intrinsic turns in the other order
        letters, angles = letters[::-1], angles[::-1]
    motion = (*(None for _ in position), *angles)
    q0 = [*position, *angles]
    return turns(sequence=letters, slides=np.eye(3)[: len(position)], motion=motion, q0=q0, **ends)


def _followed_attitude_joint(case: Case, C_BM: Array, position: tuple[float, ...], ends: dict[str, Any]) -> Joint:
    """A joint with free translations and with angles prescribed along the attitudes of a file.

    Raises CaseError for a file that is no such message, does not cover the run, or that no three turns fit.
    """
    attitude, epoch = case.attitude, case.environment.epoch
    assert attitude.ephemeris is not None and epoch is not None  # set by the reader of the case
    duration = case.run.length(None if case.orbit.kind == "none" else case.orbit.period)
    try:
        axes, angles = followed_angles(case.file_path(attitude.ephemeris), epoch, duration, C_BM)
    except ValueError as error:
        raise CaseError(case.path.name, [Problem("attitude.ephemeris", str(error))]) from None
    q0 = np.array([*position, *(float(angle(0.0)[0]) for angle in angles)])
    motion = (*(None for _ in position), *angles)
    slides = np.eye(3)[: len(position)]
    return Joint(translations=slides, rotations=axes, kind="general", motion=motion, q0=q0, parent=None, **ends)


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
