"""Joints lowered to flat arrays: axes, springs, prescribed freedoms, and the markers they join."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body import Marker
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.pool import Pool, Scratch, add_marker
from femflex.rotations import EULER_PARAMETERS, MODIFIED, NAMED_SEQUENCES, RODRIGUES, is_extrinsic, letters_of
from femflex.system import Joint, System
from femflex.system.joint_coordinates import OPEN

ROUNDING = 1e-12  # slides closer than this to orthonormal count as such

BALL_CODES = {EULER_PARAMETERS: at.BALL_QUATERNION, RODRIGUES: at.BALL_RODRIGUES, MODIFIED: at.BALL_MODIFIED}


def lower_joint(record: np.void, joint: Joint, system: System, pool: Pool) -> None:
    """Axes, rotation set, springs and dampers of a joint."""
    record["hidden"] = int(joint.parent is None and system.orbit is not None and not system.orbit.free)
    record["n_slide"], record["n_turn"] = len(joint.translations), len(joint.rotations)
    axes: list[Array | list[float]] = [joint.translations.ravel(), joint.rotations.ravel()]
    if joint.ball in NAMED_SEQUENCES:
        record["ball"] = at.BALL_EXTRINSIC if is_extrinsic(joint.ball) else at.BALL_ANGLES
        axes.append(axis_numbers(joint.ball))
    elif joint.ball is not None:
        record["ball"] = BALL_CODES[joint.ball]
    if joint.rebase:
        record["reference"] = record["q"] + joint.ball_slice().stop
    record["n_h"] = 3 * record["hidden"] + joint.n_u
    record["axes"] = pool.add(np.concatenate(axes))
    record["spring"], record["damper"], record["rest"] = (
        pool.add(v) for v in (joint.stiffness, joint.damping, joint.rest)
    )
    record["sprung"] = int(bool(joint.stiffness.any() or joint.damping.any()))


def lower_prescribed(
    head: np.void, bodies: NDArray[np.void], system: System, pool: Pool, scratch: Scratch
) -> NDArray[np.void]:
    """Write one HOLD record per prescribed freedom, and the place of its value in the model."""
    entries, z = [], 0
    for record, name in zip(bodies[1:], system.order, strict=True):
        joint = system.joint_of(name)
        for k, profile in joint.prescribed.items():
            entries.append((int(record["q"]) + k, int(record["u"]) + k, pool.add(profile.numbers), -1))
        for latch in joint.latches:
            k = latch.freedom
            if latch.rigid:
                entries.append((int(record["q"]) + k, int(record["u"]) + k, 0, z))
            z += len(OPEN)
        if joint.prescribed or joint.locking:
            record["held"], record["full"] = 1, 0
    head["n_holds"] = len(entries)
    if entries:
        head["held_q"] = scratch.take(int(head["n_q"]))
        for key in ("held_u", "known", "flags", "drives"):
            head[key] = scratch.take(int(head["n_u"]))
        for key in ("known", "flags", "drives"):
            bodies[key] = head[key] + bodies["u"]
    return np.array(entries, at.HOLD)


def lower_markers(bodies: NDArray[np.void], i: int, joint: Joint, system: System, pool: Pool, scratch: Scratch) -> None:
    """Markers P and Q of the joint of body i; their carriers' elastic blocks become dense when the markers move."""
    record, parent = bodies[i], bodies[bodies[i]["parent"]]
    marker_Q = system.bodies[joint.child].marker(joint.child_marker)
    marker_P = Marker.at_position(np.zeros(3))
    if joint.parent is not None:
        marker_P = system.bodies[joint.parent].marker(joint.parent_marker)
    record["place"], record["shape"], record["spin"], record["bends"] = add_marker(
        joint.parent, joint.parent_marker, system, pool
    )
    record["own_place"], record["own_shape"], record["own_spin"], record["own_bends"] = add_marker(
        joint.child, joint.child_marker, system, pool
    )
    record["Phi"] = scratch.take(6 * parent["row"])
    if record["bends"]:
        parent["dense"] = 1
    if record["own_bends"]:
        record["dense"] = 1
    record["welded"] = int(record["n_h"] == 0 and not record["bends"] and not record["own_bends"])
    C_ip = marker_Q.orientation @ marker_P.orientation.T
    record["welded_at"] = pool.add(np.concatenate([C_ip.ravel(), marker_P.position - C_ip.T @ marker_Q.position]))
    products = joint.translations @ joint.translations.T
    orthonormal = record["hidden"] or np.abs(products - np.eye(len(products))).max(initial=0.0) < ROUNDING
    six = record["n_h"] == 6 and joint.ball is not None and orthonormal
    record["full"] = int(bool(six and joint.parent is None and not record["sprung"] and not record["own_bends"]))


def axis_numbers(sequence: str) -> list[float]:
    """Axis numbers of the intrinsic turns that make a sequence: "xzy" gives 0, 2, 1, "extrinsic xzy" 1, 2, 0."""
    letters = letters_of(sequence)
    return [float("xyz".index(letter)) for letter in (letters[::-1] if is_extrinsic(sequence) else letters)]
