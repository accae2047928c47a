"""Displacement of markers relative to the root body: by the turns and slides of joints and by all shapes on the way.

    d = C_BN (r_M - r_B) - R_M        components along the axes of the root body B

R_M is the marker's position there with undeformed bodies, every joint where its springs are free; a joint without a
spring is where it starts, and a prescribed coordinate is that of t = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.places import joint_places
from femflex.dynamics.layout.lower import reported_markers
from femflex.dynamics.observe.markers import is_deformable_marker
from femflex.dynamics.observe.row import XYZ
from femflex.dynamics.report import Observation, Report
from femflex.rotations import coordinates_from_dcm, dcm_from_quaternion, dcm_from_vector
from femflex.system import Channel, Joint, System
from femflex.system.segments import marker_label


class Displacements(Report):
    """Every marker that moves in axes of its root body."""

    def channels(self, system: System) -> dict[str, Channel]:
        text = "displacement of {} relative to {}, joints included"
        return {
            f"markers/{label}/displacement": Channel("m", text.format(label, root), (3,), XYZ, f"body {root}")
            for label, root in displaced_markers(system).items()
        }

    def observe(self, seen: Observation) -> Iterator[Array]:
        model = seen.model
        x = model.x0.copy()
        for joint, iq, _ in joint_places(seen.system):
            n = seen.system.bodies[joint.child].n_modes
            x[iq + joint.n_q : iq + joint.n_q + n] = 0.0
            if joint.parent is not None:
                x[iq : iq + joint.n_q] = rest_coordinates(joint)
        reference = Observation(model, np.zeros(1), x[None])
        for label, root in displaced_markers(seen.system).items():
            position = in_root_axes(seen.__getitem__, label, root)
            yield position - in_root_axes(reference.columns, label, root)[0]


def in_root_axes(channel: Callable[[str], Array], label: str, root: str) -> Array:
    """C_BN (r_M - r_B) (n_t, 3) of a marker."""
    C_NB = dcm_from_quaternion(channel(f"bodies/{root}/attitude"))
    return np.einsum("tij,ti->tj", C_NB, channel(f"markers/{label}/position") - channel(f"bodies/{root}/position"))


def displaced_markers(system: System) -> dict[str, str]:
    """Root body of every marker that moves in its axes, by the marker's label; without the root's own markers."""
    owners = {part: name for name, parts in system.segments.items() for part in parts}
    out = {}
    for body, marker in reported_markers(system):
        root, moves = body, body in system.varying or is_deformable_marker(system, body, marker)
        while (joint := system.joint_of(root)).parent is not None:
            moves = (
                moves
                or joint.n_u > 0
                or root in system.varying
                or is_deformable_marker(system, root, joint.child_marker)
            )
            root = joint.parent
            moves = moves or root in system.varying or is_deformable_marker(system, root, joint.parent_marker)
        if moves and owners.get(root, root) != owners.get(body, body):
            out[marker_label(system.segments, body, marker)] = root
    return out


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
