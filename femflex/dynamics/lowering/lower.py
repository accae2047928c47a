"""Lowering a System to flat arrays: every number into the pool, every place into the records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody, Marker, StrainTensors
from femflex.dynamics.arithmetic.lanes import padded
from femflex.dynamics.bodies.stiffening import monomial_table
from femflex.dynamics.lowering import layout as at
from femflex.dynamics.lowering.pool import Pool, Scratch, length_of, put_marker
from femflex.dynamics.lowering.ties import lower_constraints, lower_springs
from femflex.rotations import EULER_PARAMETERS, MODIFIED, NAMED_SEQUENCES, RODRIGUES, is_extrinsic, letters_of
from femflex.system import Joint, Load, System
from femflex.system.law import LATCHED

Array = NDArray[np.float64]
Table = NDArray[np.int64]

ROUNDING = 1e-12  # relative; an elastic mass or stiffness closer than this to its diagonal counts as diagonal

FRAME_CODES = {"inertial": at.FRAME_INERTIAL, "orbital": at.FRAME_ORBITAL, "spinning": at.FRAME_SPINNING}
BALL_CODES = {EULER_PARAMETERS: at.BALL_QUATERNION, RODRIGUES: at.BALL_RODRIGUES, MODIFIED: at.BALL_MODIFIED}
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
    for i, name in enumerate(order, start=1):
        lower_markers(bodies, i, system.joint_of(name), system, pool, scratch)
    loads = np.array([lower_load(load, system, order, pool) for load in system.loads], at.LOAD)
    markers = np.array([lower_marker(b, m, system, order, pool) for b, m in reported_markers(system)], at.MARKER)
    head = np.zeros(1, at.HEADER)
    head[0]["n_bodies"], head[0]["n_loads"], head[0]["n_markers"] = len(bodies), len(loads), len(markers)
    head[0]["n_q"], head[0]["n_u"] = nq, nu
    head[0]["angle_axes"] = pool.put(axis_numbers(system.libration_sequence))
    head[0]["mass"] = pool.put([sum(body.moments.mass for body in system.bodies.values())])
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
        record["reference"] = record["q"] + joint.ball_places().stop
    record["n_h"] = 3 * record["hidden"] + joint.n_u
    record["axes"] = pool.put(np.concatenate(axes))
    record["spring"], record["damper"], record["rest"] = (
        pool.put(v) for v in (joint.stiffness, joint.damping, joint.rest)
    )
    record["sprung"] = int(bool(joint.stiffness.any() or joint.damping.any()))


def lower_holds(
    head: np.void, bodies: NDArray[np.void], system: System, pool: Pool, scratch: Scratch
) -> NDArray[np.void]:
    """One HOLD record per held freedom, and where the model keeps what it holds."""
    found = []
    for record, name in zip(bodies[1:], system.order, strict=True):
        joint = system.joint_of(name)
        for k, profile in joint.held.items():
            found.append((int(record["q"]) + k, int(record["u"]) + k, pool.put(profile.numbers), 0))
        for latch, place in zip(joint.latches, joint.latch_places(), strict=True):
            k = latch.freedom
            if latch.rigid:
                found.append((int(record["q"]) + k, int(record["u"]) + k, 0, int(record["q"]) + place))
        if joint.held or joint.locking:
            record["held"], record["full"] = 1, 0
    head["n_holds"] = len(found)
    if found:
        head["held_q"] = scratch.take(int(head["n_q"]))
        for key in ("held_u", "known", "flags", "drives"):
            head[key] = scratch.take(int(head["n_u"]))
        for key in ("known", "flags", "drives"):
            bodies[key] = head[key] + bodies["u"]
    return np.array(found, at.HOLD)


def lower_laws(head: np.void, bodies: NDArray[np.void], system: System, pool: Pool) -> NDArray[np.void]:
    """LAW records: the pieces of every law, then the springs and dampers of elastic latches."""
    found: list[tuple[int, ...]] = []
    row = 0
    for i, name in enumerate(system.order, start=1):
        record, joint = bodies[i], system.joint_of(name)
        q, u = int(record["q"]), int(record["u"])
        for law in joint.laws:
            k = law.freedom
            found += [(i, k, q + k, u + k, kind, pool.put(numbers), 0, row) for kind, numbers in law.pieces()]
            row += 1
        for latch, place in zip(joint.latches, joint.latch_places(), strict=True):
            if not latch.rigid:
                k, numbers = latch.freedom, pool.put([latch.stiffness, latch.damping, latch.at])
                found.append((i, k, q + k, u + k, LATCHED, numbers, q + place, row))
                row += 1
        record["n_latched"] = 2 * len(joint.latches)
        record["latched"] = q + joint.n_q - record["n_latched"]
        if joint.laws or any(not latch.rigid for latch in joint.latches):
            record["sprung"], record["lawful"], record["full"] = 1, 1, 0
    head["n_laws"], head["law_rows"] = len(found), row
    return np.array(found, at.LAW)


def lower_body(record: np.void, body: FlexibleBody, pool: Pool, scratch: Scratch) -> None:
    """Moments, stiffness and damping of a body, and its work arrays."""
    n, moments, P = body.n_modes, body.moments, body.moments.second
    row, wide = padded(n), padded(body.n_shapes)
    record["n"], record["row"], record["stride"] = n, row, row + 8
    record["n_shapes"], record["wide"] = body.n_shapes, wide
    record["mass"] = pool.put([moments.mass, *moments.first[0], *P[0, :, 0, :].ravel()])
    record["first"] = pool.put_rows(moments.first[1:].T)
    record["momentum"] = pool.put(np.pad(moments.first[1:], ((0, wide - body.n_shapes), (0, 1))))
    record["second"] = pool.put_rows(P[:, :, 1:, :].swapaxes(2, 3))  # A a c k
    P = P[1:, :, 1:, :]  # j b k c
    gyro = np.stack([P[:, b, :, c] - P[:, c, :, b] for b, c in ((1, 2), (2, 0), (0, 1))])  # a j k
    record["gyro"] = pool.put_rows(gyro.swapaxes(0, 1))
    lower_elastic_mass(record, moments.elastic_mass(), n, pool)
    V1 = (body.strain.V1 + body.strain.V1.T) / 2
    record["stiffness"], record["damping"] = pool.put_rows(V1), pool.put_rows(body.damping.T)
    record["own_stiffness"], record["own_damping"] = pool.put_rows(np.diag(V1)), pool.put_rows(np.diag(body.damping))
    record["f0"] = pool.put_rows(body.strain.f0)
    record["diagonal"] = int(_is_diagonal(V1) and _is_diagonal(body.damping))
    lower_curved_strain(record, body.strain, pool, scratch)
    record["work"] = scratch.take(at.W_FIXED)
    for key, size in (("delta", wide), ("ddelta", wide), ("pn", wide), ("accel", row), ("pivot", row)):
        record[key] = scratch.take(size)
    for key, size in (("Z", 9 * wide), ("G", 6 * row), ("N", 8 * row), ("border", row * record["stride"])):
        record[key] = scratch.take(size)
    lower_slaves(record, body.slaves, pool, scratch)


def lower_curved_strain(record: np.void, strain: StrainTensors, pool: Pool, scratch: Scratch) -> None:
    """V2 and V3 of a body with nonlinear strain."""
    if strain.is_linear or not len(strain.f0):
        return
    table = monomial_table(strain)
    n_blocks, count, columns = table.shape
    record["nonlinear"], record["n_blocks"], record["curved"] = 1, n_blocks, pool.put(table)
    record["monomials"], record["varying"] = scratch.take(count), scratch.take(n_blocks * columns)


def lower_slaves(record: np.void, slaves: Array, pool: Pool, scratch: Scratch) -> None:
    """How the slaved shapes of a condensed body follow; its elastic block changes with the motion."""
    if not len(slaves):
        return
    row, wide = record["row"], record["wide"]
    record["n_slaves"], record["dense"] = len(slaves), 1
    record["slaves"] = pool.put_rows((slaves + slaves.swapaxes(1, 2)) / 2)
    sizes = {"drift": wide, "tie": len(slaves) * row, "pull": row, "columns": 6 * wide, "spread": 8 * wide}
    for key, size in sizes.items():
        record[key] = scratch.take(size)


def lower_elastic_mass(record: np.void, elastic_mass: Array, n: int, pool: Pool) -> None:
    """The elastic mass of all shapes, and the factors of that of the n coordinates."""
    record["elastic_mass"] = pool.put_rows(elastic_mass)
    elastic_mass = elastic_mass[:n, :n]
    C = np.linalg.cholesky(elastic_mass)
    pivots = np.diag(C) ** 2
    record["elastic_factor"] = pool.put_rows(np.diag(C)[:, None] * C.T)  # U of Gauss's elimination
    record["elastic_pivot"] = pool.put_rows(1.0 / pivots)
    record["orthonormal"] = int(np.abs(elastic_mass - np.eye(n)).max(initial=0.0) < ROUNDING)


def lower_markers(bodies: NDArray[np.void], i: int, joint: Joint, system: System, pool: Pool, scratch: Scratch) -> None:
    """Markers P and Q of the joint of body i; their carriers' elastic blocks become dense when the markers move."""
    record, parent = bodies[i], bodies[bodies[i]["parent"]]
    own = system.bodies[joint.child].marker(joint.child_marker)
    above = (
        Marker.rigid(np.zeros(3)) if joint.parent is None else system.bodies[joint.parent].marker(joint.parent_marker)
    )
    record["place"], record["shape"], record["spin"], record["bends"] = put_marker(above, pool)
    record["own_place"], record["own_shape"], record["own_spin"], record["own_bends"] = put_marker(own, pool)
    record["Phi"] = scratch.take(6 * parent["row"])
    if record["bends"]:
        parent["dense"] = 1
    if record["own_bends"]:
        record["dense"] = 1
    record["welded"] = int(record["n_h"] == 0 and not record["bends"] and not record["own_bends"])
    C_ip = own.orientation @ above.orientation.T
    record["welded_at"] = pool.put(np.concatenate([C_ip.ravel(), above.position - C_ip.T @ own.position]))
    orthonormal = record["hidden"] or np.allclose(
        joint.translations @ joint.translations.T, np.eye(len(joint.translations)), atol=ROUNDING
    )
    six = record["n_h"] == 6 and joint.ball is not None and orthonormal
    record["full"] = int(bool(six and joint.parent is None and not record["sprung"] and not record["own_bends"]))


def lower_load(load: Load, system: System, order: list[str], pool: Pool) -> NDArray[np.void]:
    """One LOAD record."""
    record = np.zeros((), at.LOAD)
    record["body"], record["frame"] = 1 + order.index(load.body), LOAD_CODES[load.frame]
    marker = system.bodies[load.body].marker(load.marker)
    record["place"], record["shape"], record["spin"], record["bends"] = put_marker(marker, pool)
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
    record["place"], record["shape"], record["spin"], record["bends"] = put_marker(
        system.bodies[body].marker(name), pool
    )
    return record


def axis_numbers(sequence: str) -> list[float]:
    """Axis numbers of the intrinsic turns that make a sequence: "xzy" gives 0, 2, 1, "extrinsic xzy" 1, 2, 0."""
    letters = letters_of(sequence)
    return [float("xyz".index(letter)) for letter in (letters[::-1] if is_extrinsic(sequence) else letters)]


def _is_diagonal(a: Array) -> bool:
    off = a - np.diag(np.diag(a))
    return bool(np.abs(off).max(initial=0.0) <= ROUNDING * np.abs(a).max(initial=0.0))
