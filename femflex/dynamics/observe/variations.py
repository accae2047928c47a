"""Report of bodies that vary with time: their mass, and the power that the change supplies to the system.

The power belongs to whatever drives the change, and nothing else in the balance of energy holds it:

    flow       int w . (a - f) dm of moving material, a its acceleration and f gravity; what is lost as material is
               picked up or stopped is taken off, for d/dt int w.w/2 dm is what the rates of `speed` say
    markers    of joints, loads, springs and effectors at markers that move with time, by the velocity of these
    stiffness  energy of strain that changes at a fixed shape
    growth     energy of motion, and of weight, that arriving mass has at the velocity of its place

Of bodies whose change does not follow from a length, loads, springs, effectors and loops at markers that move are not
counted; nor is gravity of an orbit on arriving mass.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.implicit.residual import residual
from femflex.dynamics.layout.records import (
    HEADER,
    N_HEADER,
    ORBIT_FREE,
    ORBIT_NONE,
    VARIES,
    W_ACC,
    W_CIN,
    W_CIP,
    W_OMEGA,
    W_P,
    W_POS,
    W_R,
    W_VEL,
    body_records,
)
from femflex.dynamics.layout.variations import WORKED
from femflex.dynamics.observe.drum import CHANNELS, drum_channels, drum_row, lengths_of, section_channels
from femflex.dynamics.observe.forces_at_markers import acting_forces, constraint_forces
from femflex.dynamics.observe.material import BodyMotion, flow_power, growth_power, stiffness_power, strain_power
from femflex.dynamics.report import Observation, Report
from femflex.system import Channel, LengthTable, System
from femflex.system.variation import COLUMNS, Block

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


class Variations(Report):
    """Bodies that vary, in tree order, with their drums and the forces in their sections; then the power of all."""

    def channels(self, system: System) -> dict[str, Channel]:
        out: dict[str, Channel] = {}
        for name in varying_names(system):
            out[f"bodies/{name}/mass"] = Channel("kg", f"mass of {name}")
            out[f"bodies/{name}/power"] = Channel("W", f"power that the change of {name} gives to the system")
            if table := lengths_of(system).get(name):
                out |= drum_channels(name, table) | section_channels(name, table)
        if out:
            out["monitors/variation_power"] = Channel("W", "power that bodies which vary with time give to the system")
        if lengths_of(system):
            out["monitors/pickup_loss"] = Channel("W", "power lost where stowed material is picked up or stopped")
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        model, names, lengths = seen.model, varying_names(seen.system), lengths_of(seen.system)
        acting = {name: [acting_forces(seen, name, j) for j in range(len(seen.times))] for name in lengths}
        mass, power = np.empty((2, len(names), len(seen.times)))
        drums = {name: np.empty((len(CHANNELS), len(seen.times))) for name in lengths}
        sections: dict[str, list[dict[str, Array]]] = {name: [] for name in lengths}
        for j, (t, x) in enumerate(zip(seen.times, seen.states, strict=True)):
            gather_forces(model, float(t), x)
            for i, name in enumerate(names):
                k = 1 + seen.system.order.index(name)
                mass[i, j], power[i, j] = model.pool[int(body_records(model.table)[k]["mass"])], change_power(model, k)
                if name in lengths:
                    length = length_at(model, name, t, x)
                    power[i, j] -= length[1] * external_work_per_length(model, k)
                    drums[name][:, j] = drum_report(model, k, lengths[name], length, power[i, j])
                    sections[name].append(section_report(model, k, lengths[name], length, acting[name][j]))
        for i, name in enumerate(names):
            yield from (mass[i], power[i])
            if name in lengths:
                yield from drums[name]
                yield from section_values(lengths[name], sections[name])
        yield power.sum(axis=0)
        if lengths:
            losses = list(CHANNELS).index("pickup_loss")
            yield sum((drum[losses] for drum in drums.values()), np.zeros(len(seen.times)))


def section_values(table: LengthTable, reports: list[dict[str, Array]]) -> Iterator[Array]:
    """Values (n_t, n_stations) of `section_channels` from what the sections report of each instant."""
    if table.sections is not None:
        for key in table.sections.resultants:
            yield np.array([report[key] for report in reports]).reshape(-1, len(table.sections.stations))


def varying_names(system: System) -> list[str]:
    """Names of the bodies that vary, in tree order."""
    return [name for name in system.order if name in system.varying]


def length_at(model: Model, name: str, t: float, x: Array) -> tuple[float, float, float]:
    """A body's length, its rate and its acceleration, at the state x (n_x,) that was gathered last."""
    table = model.system.varying[name].write
    assert isinstance(table, LengthTable)
    if not isinstance(table.length, str):
        L, U, acceleration = (float(v) for v in table.length(t))
        return L, U, acceleration
    z, head = model.parts(x)[2], model.table[:N_HEADER].view(HEADER)[0]
    numbers = int(body_records(model.table)[1 + model.system.order.index(name)]["numbers"])
    position, slot = int(model.pool[numbers + 8]), int(model.pool[numbers + 9])
    return float(z[position]), float(z[position + 1]), float(model.work[int(head["z"]) + slot])


def drum_report(
    model: Model, k: int, table: LengthTable, at_length: tuple[float, float, float], power: float
) -> tuple[float, ...]:
    """Return the values (`drum_row`) of the drum of body record k, at the state that was gathered last."""
    records, work = body_records(model.table), model.work
    b, motion = records[k], body_motion(model, k)
    variation = model.system.varying[model.system.order[k - 1]]
    layout = Block(variation.whole or model.system.bodies[model.system.order[k - 1]], variation.varies)
    length, rate, acceleration = at_length
    unit = unit_pool(model, b, table)
    marker_force = sum(
        (
            joint_power_at_P(child, b, unit, work, motion)
            for child in records[k + 1 :]
            if child["parent"] == k and child["bends"] >= VARIES
        ),
        0.0,
    )
    if b["own_bends"] >= VARIES:
        marker_force += joint_power_at_Q(b, unit, work, motion)
    marker_force -= external_work_per_length(model, k)
    return drum_row(b, layout, table, unit, motion, (length, rate, acceleration), marker_force, variation.acting, power)


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
    attached += [(marker, -force) for marker, _, force, _ in constraint_forces(model, k)]
    for child, child_name in zip(records[k + 1 :], model.system.order[k:], strict=True):
        if child["parent"] == k:
            w, joint = int(child["work"]), model.system.joint_of(child_name)
            C = model.work[w + W_CIP : w + W_CIP + 12].reshape(3, 4)[:, :3]  # parent to child components
            attached.append((joint.parent_marker, C.T @ model.work[w + W_P : w + W_P + 3]))
    motion, with_shapes = body_motion(model, k), model.system.varying[model.system.order[k - 1]].whole
    if with_shapes is not None:  # a body without its shapes, whose sections are those of the body that has them
        zeros = np.zeros(1 + with_shapes.n_shapes)
        motion = replace(motion, y=np.eye(1, len(zeros))[0], dy=zeros, ddy=zeros)
    return table.sections.report(at_length, motion, attached)


def gather_forces(model: Model, t: float, x: Array) -> None:
    """Leave in the work array the motion of all bodies at the state x (n_x,), and the forces in joints."""
    n_q, udot = model.n_q, model.parts(model.state_rate(t, x))[1]
    q, u = np.ascontiguousarray(x[:n_q], float), np.ascontiguousarray(x[n_q:], float)
    for name, table in lengths_of(model.system).items():
        b = body_records(model.table)[1 + model.system.order.index(name)]
        unit = int(b["unit"])
        model.pool[unit - WORKED] = 0.0
        model.pool[unit : unit + table.size] = table.block_at(length_at(model, name, t, x)[0], 1.0)
    with nullcontext() if model.constraints is None or model.reduced else model.constraints.pushed():
        residual(t, q, u, udot.copy(), np.empty(model.n_u), *model.workspace.arrays)
    if model.constraints is None or model.reduced:
        return
    for name, table in lengths_of(model.system).items():
        k = 1 + model.system.order.index(name)
        b, motion = body_records(model.table)[k], body_motion(model, k)
        pool = unit_pool(model, b, table)
        for _, rows, force, torque in constraint_forces(model, k, moving=True):
            arm = marker_position(b, rows, pool, motion)
            model.pool[int(b["unit"]) - WORKED] += marker_power(b, rows, pool, motion, force, torque, arm)


def unit_pool(model: Model, b: np.void, table: LengthTable) -> Array:
    """The pool with the block of a unit rate of the length in the place of the body's."""
    unit, block = model.pool.copy(), int(b["block"])
    unit[block : block + table.size] = unit[int(b["unit"]) : int(b["unit"]) + table.size]
    return unit


def marker_position(b: np.void, rows: tuple[int, int, int], pool: Array, motion: BodyMotion) -> Array:
    """Place of a marker from the body's origin (3,) [m], body components."""
    n, wide = int(b["n_shapes"]), int(b["wide"])
    phi = pool[rows[1] : rows[1] + 3 * wide].reshape(3, wide)[:, :n]
    return np.asarray(pool[rows[0] : rows[0] + 3] + phi @ motion.y[1:])


def external_work_per_length(model: Model, k: int) -> float:
    """Return the force along the length of body record k by forces at its markers and mass points, less joints [N].

    At the state that was gathered last.
    """
    return float(model.pool[int(body_records(model.table)[k]["unit"]) - WORKED])


def change_power(model: Model, k: int) -> float:
    """Power of the change of body record k [W], at the state that was gathered last."""
    records, pool, work = body_records(model.table), model.pool, model.work
    b, name = records[k], model.system.order[k - 1]
    variation = model.system.varying[name]
    layout = Block(variation.whole or model.system.bodies[name], variation.varies)
    parts, motion = variation.acting, body_motion(model, k)
    delta, block, total = motion.y[1:], int(b["block"]), 0.0
    if "flow" in parts:
        total += flow_power(b, pool, motion)
    if "growth" in parts:
        power, mass, s = growth_power(block + layout.growth, int(b["n_shapes"]), pool, motion)
        w, g = int(b["work"]), model.system.environment.gravity
        total += power - float(g @ (mass * work[w + W_POS : w + W_POS + 3] + _C(work, w).T @ s))
    if "stiffness" in parts:
        total += stiffness_power(
            block + layout.stiffness_rate, block + layout.f0_rate, int(b["n"]), pool, delta[: int(b["n"])]
        )
    if "strain" in parts:
        start = block + layout.strain_rate
        total += strain_power(start, int(b["n"]), int(b["n_blocks"]), COLUMNS, pool, delta[: int(b["n"])])
    for child in records[k + 1 :]:
        if child["parent"] == k and child["bends"] >= VARIES:
            total += joint_power_at_P(child, b, pool, work, motion)
    if b["own_bends"] >= VARIES:
        total += joint_power_at_Q(b, pool, work, motion)
    return total


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
    C, head = _C(work, w), model.table[:N_HEADER].view(HEADER)[0]
    a, gradient = work[w + W_ACC : w + W_ACC + 3].copy(), np.zeros((3, 3))
    if head["orbit"] == ORBIT_NONE:
        a = a - C @ model.system.environment.gravity
    else:
        o, c = int(head["orbit_state"]), work[int(head["total"]) : int(head["total"]) + 6]
        R = work[o + 13 : o + 16] + (c[:3] if head["orbit"] == ORBIT_FREE else 0.0)
        radius = float(np.linalg.norm(R))
        e = C @ R / radius
        gradient = pool[int(head["orbit_data"])] / radius**3 * (np.eye(3) - 3.0 * np.outer(e, e))
        a = a + gradient @ (C @ (work[w + W_POS : w + W_POS + 3] - c[:3]))
        a = a - C @ c[3:]
    velocity = work[w + W_VEL : w + W_VEL + 3].copy()
    alpha, omega = work[w + W_ACC + 4 : w + W_ACC + 7].copy(), work[w + W_OMEGA : w + W_OMEGA + 3].copy()
    y, dy = np.concatenate([[1.0], delta]), np.concatenate([[0.0], ddelta])
    return BodyMotion(velocity, a, omega, alpha, gradient, y, dy, ddy)


def joint_power_at_P(child: np.void, parent: np.void, pool: Array, work: Array, motion: BodyMotion) -> float:
    """Return the power of a joint's force on the velocity that its marker P has in the body [W]."""
    marker, w = int(child["place"]), int(child["work"])
    C = work[w + W_CIP : w + W_CIP + 12].reshape(3, 4)[:, :3]  # parent to child components
    force, torque = C.T @ work[w + W_P : w + W_P + 3], C.T @ work[w + W_P + 4 : w + W_P + 7]
    rows = int(child["shape"]), int(child["spin"])
    return marker_power(parent, (marker, *rows), pool, motion, force, torque, work[w + W_R : w + W_R + 3])


def joint_power_at_Q(b: np.void, pool: Array, work: Array, motion: BodyMotion) -> float:
    """Power of a body's joint by the velocity of its own marker Q in itself; subtracted [W]."""
    p, rows = int(b["work"]) + W_P, (int(b["own_place"]), int(b["own_shape"]), int(b["own_spin"]))
    return -marker_power(b, rows, pool, motion, work[p : p + 3], work[p + 4 : p + 7], np.zeros(3))


def marker_power(
    b: np.void,
    rows: tuple[int, int, int],
    pool: Array,
    motion: BodyMotion,
    force: Array,
    torque: Array,
    arm_point: Array,
) -> float:
    """Power of a force and of a torque about the place `at`, by the velocity and rate that a marker has of itself.

    All in components of the body b; rows: where the marker's place, phi and psi stand in the pool.
    """
    n, wide, delta = int(b["n_shapes"]), int(b["wide"]), motion.y[1:]
    marker, shape, spin = rows
    phi, dphi, psi, dpsi = (
        pool[first : first + 3 * wide].reshape(3, wide)[:, :n]
        for start in (shape, spin)
        for first in (start, start + 3 * wide)
    )
    velocity = pool[marker + 16 : marker + 19] + dphi @ delta
    rate = _tangent(psi @ delta) @ (dpsi @ delta)
    arm = arm_point - (pool[marker : marker + 3] + phi @ delta)
    return float(force @ velocity + (torque + np.cross(arm, force)) @ rate)


def _C(work: Array, w: int) -> Array:
    """C_iN: inertial components to body components."""
    return work[w + W_CIN : w + W_CIN + 9].reshape(3, 3)


def _tangent(theta: Array) -> Array:
    """T of a rotation vector: rate of the turn = T dtheta/dt."""
    angle = float(np.linalg.norm(theta))
    X = np.cross(np.eye(3), theta)  # skew(theta)
    if angle < 1e-4:
        return np.eye(3) + X / 2 + X @ X / 6
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * X + (angle - np.sin(angle)) / angle**3 * X @ X
