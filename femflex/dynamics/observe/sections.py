"""Forces in the sections of deploying members, from the motion of the body and all forces on it.

Motion and forces in joints and loops are read at a state that `femflex.dynamics.observe.drum.gather_changes` has
gathered last; loads, springs and effectors are read as reported.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.constraint_records import closing_record, constraint_records
from femflex.dynamics.layout.records import body_records
from femflex.dynamics.report import Observation
from femflex.rotations import dcm_from_quaternion
from femflex.system import Channel, Effector, Joint, LengthTable, Nonholonomic

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a body at an instant: that of its origin and of its shapes.

    v, a          (3,) velocity of its origin, and acceleration less gravity there
    omega, alpha  (3,) rate and angular acceleration
    gradient      (3, 3) F: gravity is less by F r at the place r from the origin
    y, dy, ddy    (1 + n,) amplitudes (1, delta) and their rates
    """

    v: Array
    a: Array
    omega: Array
    alpha: Array
    gradient: Array
    y: Array
    dy: Array
    ddy: Array


def section_channels(name: str, table: LengthTable) -> dict[str, Channel]:
    """Channels of the forces in that body's sections, if it has any."""
    if table.sections is None:
        return {}
    stations = tuple(f"{xi:g}" for xi in table.sections.stations)
    text = "{} of {} at stations by their distance from the exit over the length"
    return {
        f"bodies/{name}/{key}": Channel(unit, text.format(meaning, name), (len(stations),), stations)
        for key, (unit, meaning) in table.sections.resultants.items()
    }


def section_values(table: LengthTable, reports: list[dict[str, Array]]) -> Iterator[Array]:
    """Values (n_t, n_stations) of `section_channels` from what the sections report of each instant."""
    if table.sections is not None:
        for key in table.sections.resultants:
            yield np.array([report[key] for report in reports]).reshape(-1, len(table.sections.stations))


def section_report(
    model: Model, k: int, table: LengthTable, at_length: tuple[float, float, float], acting: Sequence[tuple[str, Array]]
) -> dict[str, Array]:
    """Return the forces in the sections of body record k, at the state that was gathered last.

    acting: marker and force (3,) of loads, springs and effectors on the body, body components.
    """
    if table.sections is None:
        return {}
    records = body_records(model.table)
    attached = [(marker, -force) for marker, force in acting]
    attached += [(marker, -force) for marker, force in constraint_forces(model, k)]
    for child, child_name in zip(records[k + 1 :], model.system.order[k:], strict=True):
        if child["parent"] == k:
            w, joint = int(child["work"]), model.system.joint_of(child_name)
            C = model.work[w + at.W_CIP : w + at.W_CIP + 12].reshape(3, 4)[:, :3]  # parent to child components
            attached.append((joint.parent_marker, C.T @ model.work[w + at.W_P : w + at.W_P + 3]))
    motion, with_shapes = body_motion(model, k), model.system.varying[model.system.order[k - 1]].whole
    if with_shapes is not None:  # a body without its shapes, whose sections are those of the body that has them
        zeros = np.zeros(1 + with_shapes.n_shapes)
        motion = replace(motion, y=np.eye(1, len(zeros))[0], dy=zeros, ddy=zeros)
    return table.sections.report(at_length, motion, attached)


def body_motion(model: Model, k: int) -> BodyMotion:
    """Return the motion of a body, its acceleration less gravity, at the state that was gathered last."""
    b, work, pool = body_records(model.table)[k], model.work, model.pool
    w, n, n_shapes = int(b["work"]), int(b["n"]), int(b["n_shapes"])
    delta, ddelta = (work[int(b[key]) : int(b[key]) + n_shapes] for key in ("delta", "ddelta"))
    ddy = np.zeros(1 + n_shapes)
    ddy[1 : 1 + n] = work[int(b["accel"]) : int(b["accel"]) + n]
    if b["n_slaves"]:
        n_s, row = int(b["n_slaves"]), int(b["row"])
        tie = work[int(b["tie"]) : int(b["tie"]) + n_s * row].reshape(n_s, row)[:, :n]
        first = int(b["drift"]) + n
        ddy[1 + n :] = tie @ ddy[1 : 1 + n] + work[first : first + n_s]
    C, head = work[w + at.W_CIN : w + at.W_CIN + 9].reshape(3, 3), at.header_record(model.table)
    a, gradient = work[w + at.W_ACC : w + at.W_ACC + 3].copy(), np.zeros((3, 3))
    if head["orbit"] == at.ORBIT_NONE:
        a = a - C @ model.system.environment.gravity
    else:
        o, c = int(head["orbit_state"]), work[int(head["total"]) : int(head["total"]) + 6]
        R = work[o + 13 : o + 16] + (c[:3] if head["orbit"] == at.ORBIT_FREE else 0.0)
        radius = float(np.linalg.norm(R))
        e = C @ R / radius
        gradient = pool[int(head["orbit_data"])] / radius**3 * (np.eye(3) - 3.0 * np.outer(e, e))
        a = a + gradient @ (C @ (work[w + at.W_POS : w + at.W_POS + 3] - c[:3]))
        a = a - C @ c[3:]
    velocity = work[w + at.W_VEL : w + at.W_VEL + 3].copy()
    alpha, omega = work[w + at.W_ACC + 4 : w + at.W_ACC + 7].copy(), work[w + at.W_OMEGA : w + at.W_OMEGA + 3].copy()
    y, dy = np.concatenate([[1.0], delta]), np.concatenate([[0.0], ddelta])
    return BodyMotion(velocity, a, omega, alpha, gradient, y, dy, ddy)


def constraint_forces(model: Model, k: int) -> Iterator[tuple[str, Array]]:
    """Marker and force (3,) [N] of every loop and disc on body record k, body components."""
    if model.constraints is None:
        return
    system, first, work = model.system, int(closing_record(model.table)[0]["rows"]), model.work
    ties: list[Joint | Nonholonomic] = [*system.loops, *system.constraints]
    for tie, c in zip(ties, constraint_records(model.table), strict=True):
        if c["kind"] == layout.CONSTRAINT_GENERAL:
            continue
        names = {"P": tie.parent_marker, "Q": tie.child_marker if isinstance(tie, Joint) else tie.marker}
        for side, role in (("P", "parent"), ("Q", "child")):
            if c[role] != k:
                continue
            force = np.zeros(3)
            for i in range(int(c["n_rows"])):
                row = work[first + layout.ROW_SIZE * (int(c["first"]) + i) :][: layout.ROW_SIZE]
                place = layout.R_FP if side == "P" else layout.R_FQ
                force += row[layout.R_LAMBDA] * row[place : place + 3]
            yield str(names[side]), force


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
