"""Lowering a System to flat arrays: every number into the pool, every place into the records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.lowering import layout as at
from femflex.dynamics.lowering.bodies import lower_body
from femflex.dynamics.lowering.joints import axis_numbers, lower_holds, lower_joint, lower_laws, lower_markers
from femflex.dynamics.lowering.pool import Pool, Scratch, length_of, put_marker
from femflex.dynamics.lowering.ties import lower_constraints, lower_springs
from femflex.dynamics.lowering.variation import lower_variation
from femflex.system import Load, System

Array = NDArray[np.float64]
Table = NDArray[np.int64]

FRAME_CODES = {"inertial": at.FRAME_INERTIAL, "orbital": at.FRAME_ORBITAL, "spinning": at.FRAME_SPINNING}
LOAD_CODES = {"body": at.LOAD_BODY, "marker": at.LOAD_MARKER, "inertial": at.LOAD_INERTIAL, "orbital": at.LOAD_ORBITAL}


def lower(system: System) -> tuple[Table, Array, int]:
    """Integer table, pool and size of the work array of a system (see layout)."""
    pool, scratch = Pool(), Scratch()
    order = system.order
    bodies = np.zeros(1 + len(order), at.BODY)
    bodies[0]["work"] = scratch.take(at.W_FIXED)
    nq = nu = 0
    for i, name in enumerate(order, start=1):
        joint, body = system.joint_of(name), system.bodies[name]
        record = bodies[i]
        record["parent"] = 0 if joint.parent is None else 1 + order.index(joint.parent)
        record["q"], record["u"] = nq, nu
        record["qe"], record["ue"] = nq + joint.n_q, nu + joint.n_u
        nq, nu = nq + joint.n_q + body.n_modes, nu + joint.n_u + body.n_modes
        lower_joint(record, joint, system, pool)
        lower_body(record, body, pool, scratch)
        if name in system.varying:
            lower_variation(record, name, body, system.varying[name], pool, scratch)
    for i, name in enumerate(order, start=1):
        lower_markers(bodies, i, system.joint_of(name), system, pool, scratch)
    loads = np.array([lower_load(load, system, order, pool) for load in system.loads], at.LOAD)
    markers = np.array([lower_marker(b, m, system, order, pool) for b, m in reported_markers(system)], at.MARKER)
    head = np.zeros(1, at.HEADER)
    head[0]["n_bodies"], head[0]["n_loads"], head[0]["n_markers"] = len(bodies), len(loads), len(markers)
    head[0]["n_q"], head[0]["n_u"] = nq, nu
    head[0]["angle_axes"] = pool.put(axis_numbers(system.libration_sequence))
    head[0]["mass"] = pool.put_own([sum(body.moments.mass for body in system.bodies.values())])
    head[0]["n_varying"], head[0]["z"] = len(system.varying), scratch.take(0)
    head[0]["orbit_state"], head[0]["total"] = scratch.take(19), scratch.take(6)
    lower_orbit(head[0], system, pool)
    parts: list[NDArray[np.void]] = [head, bodies, loads, markers]
    holds = lower_holds(head[0], bodies, system, pool, scratch)
    head[0]["holds"] = length_of(parts)
    parts.append(holds)
    head[0]["laws"] = length_of(parts)
    parts.append(lower_laws(head[0], bodies, system, pool))
    head[0]["springs"] = length_of(parts)
    parts.append(lower_springs(head[0], system, pool))
    head[0]["closing"] = length_of(parts)
    parts += lower_constraints(head[0], bodies, system, pool, scratch)
    table = np.concatenate([part.view(np.int64).ravel() for part in parts])
    return table, pool.array(), scratch.size


def lower_orbit(head: np.void, system: System, pool: Pool) -> None:
    """Orbit, uniform gravity and base frame into the header."""
    head["frame"] = FRAME_CODES[system.frame.kind]
    head["frame_data"] = pool.put(system.frame.rate)
    head["weighs"], head["gravity"] = int(system.environment.has_weight), pool.put(system.environment.gravity)
    if system.orbit is None:
        head["orbit"] = at.ORBIT_NONE
        return
    o = system.orbit
    head["orbit"] = at.ORBIT_FREE if o.free else at.ORBIT_SPECIFIED
    E = 2 * np.arctan(np.sqrt((1 - o.eccentricity) / (1 + o.eccentricity)) * np.tan(o.true_anomaly / 2))
    mean = E - o.eccentricity * np.sin(E)
    head["orbit_data"] = pool.put([o.mu, o.semi_major_axis, o.eccentricity, o.mean_motion, mean, *o.C_NP().ravel()])


def lower_load(load: Load, system: System, order: list[str], pool: Pool) -> NDArray[np.void]:
    """One LOAD record."""
    record = np.zeros((), at.LOAD)
    record["body"], record["frame"] = 1 + order.index(load.body), LOAD_CODES[load.frame]
    record["place"], record["shape"], record["spin"], record["bends"] = put_marker(load.body, load.marker, system, pool)
    record["n_times"] = 0 if load.times is None else len(load.times)
    record["times"] = pool.put(np.zeros(1) if load.times is None else load.times)
    record["values"] = pool.put(np.hstack([np.atleast_2d(load.force), np.atleast_2d(load.torque)]))
    return record


def reported_markers(system: System) -> list[tuple[str, str]]:
    """(body, marker) of every named marker whose motion a run reports."""
    return [(b, m) for b in system.order for m in sorted(system.bodies[b].markers) if m[0] != "." and m != "origin"]


def lower_marker(body: str, name: str, system: System, order: list[str], pool: Pool) -> NDArray[np.void]:
    """One MARKER record."""
    record = np.zeros((), at.MARKER)
    record["body"] = 1 + order.index(body)
    record["place"], record["shape"], record["spin"], record["bends"] = put_marker(body, name, system, pool)
    return record
