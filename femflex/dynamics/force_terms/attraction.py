"""Attraction of the central body beyond the gradient form (eq. 6): exact over points of mass, and its oblateness.

What the equations hold already is the attraction linear over the craft about its centre of mass c, at a0 = R + c on a
free orbit (with the mu/a0^4 force of its quadrupole) or about O on a specified one. With e = (r - c)/a0, l the unit
vector from the centre to there, q = 2 l.e + e.e and s = (1 + q)^(-3/2), a point is attracted in addition by

    -(mu/a0^2) [l (s - 1 + 3 l.e) + e (s - 1)]   less the quadrupole's force per mass

without cancellation by Battin's function, 1/s - 1 = q (3 + 3 q + q^2) / (1 + (1 + q)^(3/2)). Of J2 (pole k, radius R_e)

    a = -3/2 J2 mu R_e^2/r^5 [(1 - 5 (k.r)^2/r^2) r + 2 (k.r) k]        U = J2 mu R_e^2/(2 r^3) [3 (k.r)^2/r^2 - 1]

where a specified orbit keeps what acts at O, which it holds on its ellipse.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, Record, Table
from femflex.body.mass_points import MassPoints, points_of_moments
from femflex.dynamics.bodies.shapes import combined
from femflex.dynamics.force_terms.registry import ForceTerm, Records
from femflex.dynamics.forces.calls import A_ENERGY, APPLY, REPORT
from femflex.dynamics.forces.gravity import find_center_of_mass, gravity_field, inertia_along
from femflex.dynamics.forces.marker_forces import push_on_body
from femflex.dynamics.lowering.layout import (
    ENERGY_LOAD,
    ORBIT_FREE,
    W_CIN,
    W_POS,
    body_of,
    header_of,
    record_reader,
)
from femflex.dynamics.lowering.pool import Pool, Scratch
from femflex.dynamics.lowering.unit_block import WORKED
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.lanes import offset, padded
from femflex.kernels.profiles import profile_at
from femflex.kernels.vectors import (
    UNIT,
    ZERO,
    Vector,
    add,
    dot,
    load3,
    load9,
    scale,
    sub,
    turn,
    turn_back,
)
from femflex.system import MovingPoints, System
from femflex.system.attraction import is_integrated, moving_points_of
from femflex.system.length_table import HEAD

ITEM = np.dtype([(name, "i8") for name in ("kind", "bodies", "n_bodies", "data")])  # data: pool, J2 R_e^2
GROUP = np.dtype([(name, "i8") for name in ("body", "n", "points", "shapes", "bends", "along")])
# pool: points (n, 4) and shapes (n, 3, wide); of a member that deploys points (n, 8) and shapes (n, 4, 3, wide) as
# MovingPoints has them, and along: its direction (3), 0, and rows (3, wide) for the shapes of one point
N_ITEM, N_GROUP = len(ITEM.names or ()), len(GROUP.names or ())
EXACT, OBLATE = 0, 1
NAMES = ("exact", "oblateness")

item_at = record_reader(ITEM)
group_at = record_reader(GROUP)


@inner
def reference(table: Table, pool: Array, work: Array) -> tuple[Vector, Vector, float, Vector]:
    """Centre of mass c from the base origin, unit vector l to the point of expansion, a0, the quadrupole's force per
    mass; inertial components."""
    head = header_of(table)
    find_center_of_mass(table, pool, work)
    l, _ = gravity_field(table, pool, work)
    c, R = load3(work, head["total"]), load3(work, head["orbit_state"] + 13)
    if head["orbit"] != ORBIT_FREE:
        return c, l, math.sqrt(dot(R, R)), ZERO
    R_c = add(R, c)
    a0 = math.sqrt(dot(R_c, R_c))
    J_l, trace = inertia_along(l, c, table, pool, work)
    pull = add(scale(-3.0 * trace + 15.0 * dot(l, J_l), l), scale(-6.0, J_l))
    return c, l, a0, scale(0.5 * pool[head["orbit_data"]] / (a0**4 * pool[head["mass"]]), pull)


@inner
def beyond_gradient(mu: float, a0: float, l: Vector, d: Vector) -> tuple[Vector, float]:
    """Attraction beyond its gradient at d from the point of expansion, and its potential, per mass."""
    e = scale(1.0 / a0, d)
    le, ee = dot(l, e), dot(e, e)
    q = 2.0 * le + ee
    root = math.sqrt(1.0 + q)
    f = q * (3.0 + q * (3.0 + q)) / (1.0 + (1.0 + q) * root)
    s = -f / (1.0 + f)
    a = scale(-mu / (a0 * a0), add(scale(s + 3.0 * le, l), scale(s, e)))
    return a, mu / a0 * (q / (root * (1.0 + root)) - le - 0.5 * ee + 1.5 * le * le)


@inner
def oblate(strength: float, r: Vector) -> tuple[Vector, float]:
    """Attraction of J2 at r from the centre, inertial components, and its potential, per mass; strength J2 mu R_e^2."""
    r2 = dot(r, r)
    r1 = math.sqrt(r2)
    z2 = r[2] * r[2] / r2
    k = -1.5 * strength / (r2 * r2 * r1)
    a = add(scale(k * (1.0 - 5.0 * z2), r), (0.0, 0.0, 2.0 * k * r[2]))
    return a, 0.5 * strength / (r2 * r1) * (3.0 * z2 - 1.0)


@inner
def length_of(t: float, b: Record, table: Table, pool: Array, work: Array) -> float:
    """The length of a body that deploys, at t or by its state."""
    numbers = offset(pool, b["numbers"])
    if numbers[7] > 0.0:
        return work[header_of(table)["z"] + int(numbers[8])]
    return profile_at(t, HEAD, numbers)[0]


@inner
def moving_point(g: Record, k: int, L: float, b: Record, pool: Array, work: Array) -> tuple[Vector, float, Vector, int]:
    """Place of a point of a member that deploys, its mass, its material's velocity per rate of L, and its rows."""
    point, wide, rows = g["points"] + 8 * k, b["wide"], g["along"] + 4
    e = load3(pool, g["along"])
    r = add(load3(pool, point + 2), scale(pool[point + 5] * L, e))
    velocity_per_rate = scale(pool[point + 6], e)
    if g["bends"]:
        first = g["shapes"] + 12 * wide * k
        for j in range(3 * wide):
            pool[rows + j] = pool[first + j] + pool[first + 3 * wide + j] / L
        r = add(r, combined(pool, rows, wide, work, b["delta"]))
        velocity_per_rate = add(
            velocity_per_rate, scale(1.0 / L, combined(pool, first + 6 * wide, wide, work, b["delta"]))
        )
        velocity_per_rate = add(
            velocity_per_rate, scale(1.0 / (L * L), combined(pool, first + 9 * wide, wide, work, b["delta"]))
        )
    return r, pool[point] + pool[point + 1] * L, velocity_per_rate, rows


@inner
def position_of_point(g: Record, k: int, pool: Array, work: Array, table: Table) -> Vector:
    """Place of a point of mass from its body's origin, body components."""
    b = body_of(table, g["body"])
    r = load3(pool, g["points"] + 4 * k + 1)
    if g["bends"]:
        r = add(r, combined(pool, g["shapes"] + 3 * b["wide"] * k, b["wide"], work, b["delta"]))
    return r


@inner
def attraction_at(
    kind: int, strength: float, mu: float, c: Vector, l: Vector, a0: float, quadrupole: Vector, d: Vector, free: int
) -> tuple[Vector, float]:
    """Return the acceleration by an item of the term at d from c, inertial components, and its potential, per mass."""
    if kind == EXACT:
        a, U = beyond_gradient(mu, a0, l, d)
        return sub(a, quadrupole), U
    R = scale(a0, l)
    a, U = oblate(strength * mu, add(R, d))
    if not free:
        at_O, U_O = oblate(strength * mu, R)
        return sub(a, at_O), U - U_O + dot(at_O, d)
    return a, U


@entry(APPLY)
def apply(
    t: float, q: Array, u: Array, records: int, first: int, last: int, table: Table, pool: Array, work: Array
) -> None:
    """Put the attraction beyond its gradient on all points of mass."""
    head = header_of(table)
    c, l, a0, quadrupole = reference(table, pool, work)
    mu, free = pool[head["orbit_data"]], head["orbit"] == ORBIT_FREE
    for i in range(first, last):
        item = item_at(table, records + N_ITEM * i)
        strength = pool[item["data"]]
        for j in range(item["n_bodies"]):
            g = group_at(table, item["bodies"] + N_GROUP * j)
            b = body_of(table, g["body"])
            C = load9(work, b["work"] + W_CIN)
            p = sub(load3(work, b["work"] + W_POS), c)
            for k in range(g["n"]):
                if g["along"] > 0:
                    r, mass, velocity_per_rate, shape = moving_point(
                        g, k, length_of(t, b, table, pool, work), b, pool, work
                    )
                else:
                    r, mass, velocity_per_rate = (
                        position_of_point(g, k, pool, work, table),
                        pool[g["points"] + 4 * k],
                        ZERO,
                    )
                    shape = g["shapes"] + 3 * b["wide"] * k
                a, _ = attraction_at(item["kind"], strength, mu, c, l, a0, quadrupole, add(p, turn_back(C, r)), free)
                force = scale(mass, turn(C, a))
                push_on_body(b, force, ZERO, r, UNIT, g["bends"], shape, shape, pool, work)
                if g["along"] > 0 and b["unit"] > 0:
                    pool[b["unit"] - WORKED] += dot(force, velocity_per_rate)


@entry(REPORT)
def report(
    t: float,
    q: Array,
    u: Array,
    records: int,
    n: int,
    row: Array,
    account: Array,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Potential energy of all points beyond that of the gradient form."""
    head = header_of(table)
    c, l, a0, quadrupole = reference(table, pool, work)
    mu, free = pool[head["orbit_data"]], head["orbit"] == ORBIT_FREE
    for i in range(n):
        item = item_at(table, records + N_ITEM * i)
        strength = pool[item["data"]]
        for j in range(item["n_bodies"]):
            g = group_at(table, item["bodies"] + N_GROUP * j)
            b = body_of(table, g["body"])
            C = load9(work, b["work"] + W_CIN)
            p = sub(load3(work, b["work"] + W_POS), c)
            for k in range(g["n"]):
                if g["along"] > 0:
                    r, mass, _, _ = moving_point(g, k, length_of(t, b, table, pool, work), b, pool, work)
                else:
                    r, mass = position_of_point(g, k, pool, work, table), pool[g["points"] + 4 * k]
                d = add(p, turn_back(C, r))
                _, U = attraction_at(item["kind"], strength, mu, c, l, a0, quadrupole, d, free)
                account[A_ENERGY] += mass * U


class Attraction(ForceTerm):
    """Attraction of the central body beyond the gradient form."""

    folder, energy = "attraction", ENERGY_LOAD
    apply, report = apply, report

    def items(self, system: System) -> list[str]:
        if system.orbit is None:
            return []
        present = is_integrated(system), system.environment.oblateness != 0.0
        return [name for name, is_present in zip(NAMES, present, strict=True) if is_present]

    def lower(self, system: System, head: Record, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Table:
        items = self.items(system)
        groups = np.array([lowered_points(system, name, pool) for name in system.order], GROUP)
        records = np.zeros(len(items), ITEM)
        for record, name in zip(records, items, strict=True):
            record["kind"], record["n_bodies"] = NAMES.index(name), len(groups)
            record["bodies"] = at + N_ITEM * len(items)
            record["data"] = pool.add([system.environment.oblateness * system.environment.radius**2])
        return np.concatenate([records.view(np.int64).ravel(), groups.view(np.int64).ravel()])

    def without_item(self, system: System, item: str) -> System:
        change = {"attraction": "gradient"} if item == NAMES[EXACT] else {"oblateness": 0.0}
        return replace(system, environment=replace(system.environment, **change))


def lowered_points(system: System, name: str, pool: Pool) -> NDArray[np.void]:
    """One GROUP record: the points of mass of a body, of a member that deploys, or the six of a body's moments."""
    body, moving = system.bodies[name], moving_points_of(system, name)
    if moving is not None:
        return lowered_moving(1 + system.order.index(name), moving, body.n_shapes, pool)
    points: MassPoints = body.mass_points if body.mass_points is not None else points_of_moments(body.moments)
    record = np.zeros((), GROUP)
    record["body"], record["n"] = 1 + system.order.index(name), len(points.dm)
    record["points"] = pool.add(np.column_stack([points.dm, points.rho]))
    width = padded(body.n_shapes) - points.phi.shape[2]  # sections that turn move no points to first order
    record["shapes"], record["bends"] = pool.add(np.pad(points.phi, ((0, 0), (0, 0), (0, width)))), body.n_modes > 0
    return record


def lowered_moving(body: int, points: MovingPoints, n_shapes: int, pool: Pool) -> NDArray[np.void]:
    """One GROUP record of a member that deploys."""
    record, wide = np.zeros((), GROUP), padded(n_shapes)
    record["body"], record["n"], record["bends"] = body, len(points.mass), n_shapes > 0
    record["points"] = pool.add(points.numbers)
    tables = points.tables[..., :n_shapes]  # none of a member that is held straight
    record["shapes"] = pool.add(np.pad(tables, ((0, 0), (0, 0), (0, 0), (0, wide - n_shapes))))
    record["along"] = pool.add_unshared(np.concatenate([points.direction, np.zeros(1 + 3 * wide)]))
    return record
