"""Displacement of markers relative to the root body: by the turns and slides of joints and by all shapes on the way.

    d = C_BN (r_M - r_B) - R_M        components along the axes of the root body B

R_M is the marker's position there with undeformed bodies, every joint where its springs are free; a joint without a
spring is where it starts, and a prescribed coordinate is that of t = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.channels import joint_places, rest_coordinates
from femflex.dynamics.lowering.lower import reported_markers
from femflex.dynamics.reports.observe import observe
from femflex.rotations import dcm_from_quaternion
from femflex.system import Channel, System
from femflex.system.segments import marker_label

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def is_deformable_marker(system: System, body: str, marker: str) -> bool:
    """Whether a marker moves or turns in the axes of its body."""
    flexible_body = system.bodies[body]
    m = flexible_body.marker(marker)
    return bool(m.phi.any() or m.psi.any() or m.stretch.any() or (body in system.varying and flexible_body.n_shapes))


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


def displacement_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of the displacements."""
    text = "displacement of {} relative to {}, joints included"
    return {
        f"markers/{label}/displacement": Channel("m", text.format(label, root), (3,), ("x", "y", "z"), f"body {root}")
        for label, root in displaced_markers(system).items()
    }


def undisplaced_positions(model: Model, row: Array, slices: Mapping[str, slice | int]) -> dict[str, Array]:
    """Position R_M (3,) of every displaced marker in axes of its root body, by the marker's label [m].

    row (1, n_row): for a row observed at the reference.
    """
    markers = displaced_markers(model.system)
    if not markers:
        return {}
    x = model.x0.copy()
    for joint, iq, _ in joint_places(model.system):
        n = model.system.bodies[joint.child].n_modes
        x[iq + joint.n_q : iq + joint.n_q + n] = 0.0
        if joint.parent is not None:
            x[iq : iq + joint.n_q] = rest_coordinates(joint)
    observe(np.zeros(1), x[None], row, *model.workspace.arrays)
    channels = {path: row[:, columns] for path, columns in slices.items()}
    return {label: columns[0] for label, columns in _in_root_axes(markers, channels).items()}


def observe_displacements(
    system: System, channels: Mapping[str, Array], reference: Mapping[str, Array]
) -> dict[str, Array]:
    """The channels of `displacement_channels`, from positions and attitudes, less the reference R_M (3,)."""
    positions = _in_root_axes(displaced_markers(system), channels)
    return {f"markers/{label}/displacement": position - reference[label] for label, position in positions.items()}


def _in_root_axes(markers: Mapping[str, str], channels: Mapping[str, Array]) -> dict[str, Array]:
    """C_BN (r_M - r_B) (n_t, 3) of markers, by their labels."""
    out = {}
    for label, root in markers.items():
        C_NB = dcm_from_quaternion(channels[f"bodies/{root}/attitude"])
        out[label] = np.einsum(
            "tij,ti->tj", C_NB, channels[f"markers/{label}/position"] - channels[f"bodies/{root}/position"]
        )
    return out
