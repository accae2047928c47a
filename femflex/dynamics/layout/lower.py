"""Lowering a System to flat arrays: every number into the pool, every place into the records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, Table
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.bodies import lower_body
from femflex.dynamics.layout.constraints import lower_constraints
from femflex.dynamics.layout.joints import axis_numbers, lower_joint, lower_markers, lower_prescribed
from femflex.dynamics.layout.pool import Pool, Scratch, add_marker, length_of
from femflex.dynamics.layout.variations import lower_variation
from femflex.system import System

if TYPE_CHECKING:
    from femflex.dynamics.forces.force_term import ForceTerm

FRAME_CODES = {"inertial": at.FRAME_INERTIAL, "orbital": at.FRAME_ORBITAL, "spinning": at.FRAME_SPINNING}


def lower(system: System, terms: Sequence[ForceTerm]) -> tuple[Table, Array, int]:
    """Integer table, pool and size of the work array of a system under these force terms (see layout)."""
    pool, scratch = Pool(), Scratch()
    order = system.order
    bodies = np.zeros(1 + len(order), at.BODY)
    bodies[0]["work"] = scratch.take(at.W_FIXED)
    nq = nu = n_free = 0
    states = [name for name, _ in system.state_names()]
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
            lower_variation(record, name, body, system.varying[name], states, len(states) + n_free, pool, scratch)
            n_free += int(record["free_length"])
    for i, name in enumerate(order, start=1):
        lower_markers(bodies, i, system.joint_of(name), system, pool, scratch)
    markers = np.array([lower_marker(b, m, system, order, pool) for b, m in reported_markers(system)], at.MARKER)
    head = np.zeros(1, at.HEADER)
    head[0]["n_bodies"], head[0]["n_markers"] = len(bodies), len(markers)
    head[0]["n_q"], head[0]["n_u"], head[0]["n_z"] = nq, nu, len(system.state_names())
    head[0]["angle_axes"] = pool.add(axis_numbers(system.libration_sequence))
    head[0]["mass"] = pool.add_unshared([sum(body.moments.mass for body in system.bodies.values())])
    head[0]["n_varying"] = len(system.varying)
    head[0]["orbit_state"], head[0]["total"] = scratch.take(29), scratch.take(6)
    head[0]["z"], head[0]["zdot"] = scratch.take(len(states) + n_free), scratch.take(len(states))
    head[0]["n_free"], head[0]["needs"] = n_free, scratch.take(n_free * (n_free + 1) + 3)
    head[0]["lack"] = scratch.take(nu if n_free else 0)
    head[0]["moved_u"], head[0]["account"] = scratch.take(nu), scratch.take(at.A_SIZE)
    lower_orbit(head[0], system, pool)
    parts: list[NDArray[np.void] | Table] = [head, bodies, markers]
    holds = lower_prescribed(head[0], bodies, system, pool, scratch)
    head[0]["holds"] = length_of(parts)
    parts.append(holds)
    present = [term for term in terms if term.items(system)]
    positions = []
    for term in present:
        positions.append(length_of(parts))
        parts.append(term.lower(system, head[0], bodies, pool, scratch, positions[-1]))
    head[0]["n_terms"], head[0]["terms"] = len(present), length_of(parts)
    parts += [term.record(system, position) for term, position in zip(present, positions, strict=True)]
    head[0]["closing"] = length_of(parts)
    parts += lower_constraints(head[0], bodies, system, pool, scratch)
    table = np.concatenate([part.view(np.int64).ravel() for part in parts])
    return table, pool.array(), scratch.size


def lower_orbit(head: np.void, system: System, pool: Pool) -> None:
    """Orbit, uniform gravity and base frame into the header."""
    head["frame"] = FRAME_CODES[system.frame.kind]
    head["frame_data"] = pool.add(system.frame.rate)
    head["weighs"], head["gravity"] = int(system.environment.has_weight), pool.add(system.environment.gravity)
    if system.orbit is None:
        head["orbit"] = at.ORBIT_NONE
        return
    o = system.orbit
    head["orbit"] = at.ORBIT_FREE if o.free else at.ORBIT_SPECIFIED
    E = 2 * np.arctan(np.sqrt((1 - o.eccentricity) / (1 + o.eccentricity)) * np.tan(o.true_anomaly / 2))
    mean = E - o.eccentricity * np.sin(E)
    shape, n = (o.mu, o.semi_major_axis, o.eccentricity), o.mean_motion
    moving = o.mu * (1.0 + o.anomaly_rate / n) ** 2, o.node_rate, o.perigee_rate
    path = [0.0] if o.path is None else [1.0, *(float(pool.add(profile.numbers)) for profile in o.path)]
    head["orbit_data"] = pool.add([*shape, n + o.anomaly_rate, mean, *o.C_NP().ravel(), *moving, *path])


def reported_markers(system: System) -> list[tuple[str, str]]:
    """(body, marker) of every named marker whose motion a run reports."""
    return [(b, m) for b in system.order for m in sorted(system.bodies[b].markers) if m[0] != "." and m != "origin"]


def lower_marker(body: str, name: str, system: System, order: list[str], pool: Pool) -> NDArray[np.void]:
    """One MARKER record."""
    record = np.zeros((), at.MARKER)
    record["body"] = 1 + order.index(body)
    record["place"], record["shape"], record["spin"], record["bends"] = add_marker(body, name, system, pool)
    return record
