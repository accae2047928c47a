"""Forces at a deploying body's own markers: of loads, springs and effectors as reported, of loops by their multipliers.

Those of loops are read at a state that `femflex.dynamics.observe.variations.gather_forces` has gathered last.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraint_records import closing_record, constraint_records
from femflex.dynamics.layout.records import VARIES
from femflex.rotations import dcm_from_quaternion
from femflex.system import Effector, Joint, Nonholonomic

if TYPE_CHECKING:
    from femflex.dynamics.model import Model
    from femflex.dynamics.report import Observation


Rows = tuple[int, int, int]  # where a marker's place, phi and psi stand in the pool


def constraint_forces(model: Model, k: int, moving: bool = False) -> Iterator[tuple[str, Rows, Array, Array]]:
    """Marker, its rows, force (3,) [N] and torque (3,) [N m] of every loop and disc on body record k, body components.

    The torque is about the marker. moving: at markers alone that move with the length.
    """
    if model.constraints is None:
        return
    system, first, work = model.system, int(closing_record(model.table)[0]["rows"]), model.work
    ties: list[Joint | Nonholonomic] = [*system.loops, *system.constraints]
    for tie, c in zip(ties, constraint_records(model.table), strict=True):
        if c["kind"] == layout.CONSTRAINT_GENERAL:
            continue
        names = {"P": tie.parent_marker, "Q": tie.child_marker if isinstance(tie, Joint) else tie.marker}
        for side, role in (("P", "parent"), ("Q", "child")):
            if c[role] != k or (moving and c[f"bends_{side}"] < VARIES):
                continue
            force, torque = np.zeros(3), np.zeros(3)
            for i in range(int(c["n_rows"])):
                row = work[first + layout.ROW_SIZE * (int(c["first"]) + i) :][: layout.ROW_SIZE]
                wrench = row[layout.R_FP : layout.R_FP + 6] if side == "P" else row[layout.R_FQ : layout.R_FQ + 6]
                force += row[layout.R_LAMBDA] * wrench[:3]
                torque += row[layout.R_LAMBDA] * wrench[3:]
            rows = (int(c[f"place_{side}"]), int(c[f"shape_{side}"]), int(c[f"spin_{side}"]))
            yield str(names[side]), rows, force, torque


def acting_forces(channels: Observation, name: str, j: int) -> list[tuple[str, Array]]:
    """Marker and force (3,) [N] of loads, springs and effectors at markers of a body at instant j, body components."""
    system, out = channels.system, list[tuple[str, Array]]()
    C_NB = dcm_from_quaternion(channels[f"bodies/{name}/attitude"][j])
    for load in system.loads:
        if load.body == name and load.force.any():
            out.append((load.marker, np.asarray(channels[f"loads/{load.name}/force"][j])))
    for spring in system.springs:
        ends = [(spring.parent, spring.parent_marker), (spring.body, spring.marker)]
        if name not in (spring.parent, spring.body):
            continue
        (p, v_p), (q, v_q) = (_motion(channels, body, marker, j) for body, marker in ends)
        d = q - p
        distance = float(np.linalg.norm(d))
        if not distance > 0.0:
            continue
        e = d / distance
        pull = spring.stiffness * (distance - spring.length) + spring.damping * float(e @ (v_q - v_p))
        for (body, marker), sign in zip(ends, (1.0, -1.0), strict=True):
            if body == name:
                out.append((marker, sign * pull * C_NB.T @ e))
    for effector in system.effectors:
        if isinstance(effector, Effector) and any(body == name for body, _ in effector.markers):
            forces = np.asarray(channels[f"effectors/{effector.name}/force"][j]).reshape(-1, 3)
            out += [
                (marker, C_NB.T @ force)
                for (body, marker), force in zip(effector.markers, forces, strict=True)
                if body == name
            ]
    return out


def _motion(channels: Mapping[str, Array], body: str | None, marker: str, j: int) -> tuple[Array, Array]:
    """Place and velocity of a marker, inertial components; of the base frame its origin."""
    if body is None:
        return np.zeros(3), np.zeros(3)
    path = f"markers/{body}.{marker}"
    return np.asarray(channels[f"{path}/position"][j]), np.asarray(channels[f"{path}/velocity"][j])
