"""Attraction beyond the gradient form (eq. 6): exact over points of mass, zonal harmonics, tides of Sun and Moon.

What the equations hold already is the attraction linear over the craft about its centre of mass c, at a0 = R + c on a
free orbit (with the mu/a0^4 force of its quadrupole) or about O on a specified one. A point is attracted in addition as
in `femflex.dynamics.forces.gravity`: by the rest of -mu R/|R|^3 less the quadrupole's force per mass; by the zonal
harmonics, of which a specified orbit keeps what acts at O; and by the tides of third bodies, on a free orbit alone.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, Record, Table
from femflex.body.moments import MassPoints, points_of_moments
from femflex.dynamics.bodies.shapes import combined
from femflex.dynamics.bodies.varying import length_motion
from femflex.dynamics.forces.force_term import ForceTerm, Records
from femflex.dynamics.forces.forces import APPLY, REPORT, account_of
from femflex.dynamics.forces.gravity import (
    beyond_gradient,
    find_center_of_mass,
    gravity_field,
    inertia_along,
    tide,
    zonal,
)
from femflex.dynamics.forces.marker_forces import push_on_body
from femflex.dynamics.layout.pool import Pool, Scratch
from femflex.dynamics.layout.records import (
    A_ENERGY,
    A_SUPPLIED,
    ENERGY_LOAD,
    ORBIT_FREE,
    W_CIN,
    W_POS,
    body_of,
    header_of,
    record_reader,
)
from femflex.dynamics.layout.variations import WORKED
from femflex.effectors.surroundings.earth import DAY
from femflex.effectors.surroundings.moon import moon_of_date
from femflex.effectors.surroundings.sun import AU, sun_of_date
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.lanes import offset, padded
from femflex.kernels.vectors import UNIT, ZERO, Vector, add, dot, load3, load9, scale, sub, turn, turn_back
from femflex.system import MovingPoints, System
from femflex.system.attraction import is_integrated, moving_points_of
from femflex.system.environment import THIRD_BODIES

ITEM = np.dtype([(name, "i8") for name in ("kind", "bodies", "n_bodies", "data", "highest")])
# data: pool, J_n R_e^n up to the highest degree; of a third body its mu, and the epoch
GROUP = np.dtype([(name, "i8") for name in ("body", "n", "points", "shapes", "bends", "along")])
# pool: points (n, 4) and shapes (n, 3, wide); of a member that deploys points (n, 8) and shapes (n, 4, 3, wide) as
# MovingPoints has them, and along: its direction (3), 0, and rows (3, wide) for the shapes of one point
N_ITEM, N_GROUP = len(ITEM.names or ()), len(GROUP.names or ())
EXACT, OBLATE, SUN, MOON = 0, 1, 2, 3
NAMES = ("exact", "oblateness", "sun", "moon")
STEP = 10.0  # s, of the difference over time of a tide's potential

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
def point_at(t: float, g: Record, k: int, table: Table, pool: Array, work: Array) -> tuple[Vector, float, Vector, int]:
    """Place of a point of mass from its body's origin, body components, its mass, and its rows.

    Third is its material's velocity per rate of the length, of members that deploy.
    """
    b = body_of(table, g["body"])
    wide, along = b["wide"], g["along"]
    if along == 0:
        rows, r = g["shapes"] + 3 * wide * k, load3(pool, g["points"] + 4 * k + 1)
        if g["bends"]:
            r = add(r, combined(pool, rows, wide, work, b["delta"]))
        return r, pool[g["points"] + 4 * k], ZERO, rows
    L, point, rows, e = length_motion(t, b, table, pool, work)[0], g["points"] + 8 * k, along + 4, load3(pool, along)
    r, drift = add(load3(pool, point + 2), scale(pool[point + 5] * L, e)), scale(pool[point + 6], e)
    if g["bends"]:
        first = g["shapes"] + 12 * wide * k
        for j in range(3 * wide):
            pool[rows + j] = pool[first + j] + pool[first + 3 * wide + j] / L
        r = add(r, combined(pool, rows, wide, work, b["delta"]))
        drift = add(drift, scale(1.0 / L, combined(pool, first + 6 * wide, wide, work, b["delta"])))
        drift = add(drift, scale(1.0 / (L * L), combined(pool, first + 9 * wide, wide, work, b["delta"])))
    return r, pool[point] + pool[point + 1] * L, drift, rows


@inner
def third_body(item: Record, t: float, pool: Array) -> Vector:
    """Place of Sun or Moon from the centre [m], inertial components; zero of the central body."""
    if item["kind"] == SUN:
        return scale(AU, sun_of_date(pool[item["data"] + 1] + t / DAY))
    if item["kind"] == MOON:
        return moon_of_date(pool[item["data"] + 1] + t / DAY)
    return ZERO


@inner
def left_out(item: Record, mu: float, R: Vector, quadrupole: Vector, free: int, pool: Array) -> tuple[Vector, float]:
    """Acceleration and potential per mass that an item leaves out: the quadrupole's, and at O of a specified orbit."""
    if item["kind"] == EXACT:
        return quadrupole, 0.0
    if item["kind"] == OBLATE and not free:
        return zonal(mu, offset(pool, item["data"]), item["highest"], R)
    return ZERO, 0.0


@inner
def attraction_at(
    item: Record, mu: float, l: Vector, a0: float, d: Vector, third: Vector, pool: Array
) -> tuple[Vector, float]:
    """Return the acceleration by an item at d from a0 l, inertial components, and its potential, per mass."""
    if item["kind"] == EXACT:
        return beyond_gradient(mu, a0, l, d)
    r, data = add(scale(a0, l), d), item["data"]
    if item["kind"] == OBLATE:
        return zonal(mu, offset(pool, data), item["highest"], r)
    return tide(pool[data], third, r)


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
        third = third_body(item, t, pool)
        a_out, _ = left_out(item, mu, scale(a0, l), quadrupole, free, pool)
        for j in range(item["n_bodies"]):
            g = group_at(table, item["bodies"] + N_GROUP * j)
            b = body_of(table, g["body"])
            C = load9(work, b["work"] + W_CIN)
            p = sub(load3(work, b["work"] + W_POS), c)
            for k in range(g["n"]):
                r, mass, velocity_per_rate, shape = point_at(t, g, k, table, pool, work)
                a, _ = attraction_at(item, mu, l, a0, add(p, turn_back(C, r)), third, pool)
                force = scale(mass, turn(C, sub(a, a_out)))
                push_on_body(b, force, ZERO, r, UNIT, (g["bends"], shape, shape), pool, work)
                if g["along"] > 0 and b["unit"] > 0:
                    pool[b["unit"] - WORKED] += dot(force, velocity_per_rate)


@entry(REPORT)
def report(
    t: float, q: Array, u: Array, records: int, n: int, row: Array, table: Table, pool: Array, work: Array
) -> None:
    """Potential energy of all points beyond that of the gradient form, and the power of a potential that moves."""
    head, account = header_of(table), account_of(table, work)
    c, l, a0, quadrupole = reference(table, pool, work)
    mu, free = pool[head["orbit_data"]], head["orbit"] == ORBIT_FREE
    for i in range(n):
        item = item_at(table, records + N_ITEM * i)
        moves = item["kind"] == SUN or item["kind"] == MOON
        third = third_body(item, t, pool)
        _, U_out = left_out(item, mu, scale(a0, l), quadrupole, free, pool)
        before, after = third_body(item, t - STEP, pool), third_body(item, t + STEP, pool)
        for j in range(item["n_bodies"]):
            g = group_at(table, item["bodies"] + N_GROUP * j)
            b = body_of(table, g["body"])
            C = load9(work, b["work"] + W_CIN)
            p = sub(load3(work, b["work"] + W_POS), c)
            for k in range(g["n"]):
                r, mass, _, _ = point_at(t, g, k, table, pool, work)
                d = add(p, turn_back(C, r))
                _, U = attraction_at(item, mu, l, a0, d, third, pool)
                account[A_ENERGY] += mass * (U - U_out)
                if moves:
                    R = add(scale(a0, l), d)
                    rise = tide(pool[item["data"]], after, R)[1] - tide(pool[item["data"]], before, R)[1]
                    account[A_SUPPLIED] += mass * rise / (2.0 * STEP)


class Attraction(ForceTerm):
    """Attraction of the central body beyond the gradient form."""

    folder, energy = "attraction", ENERGY_LOAD
    apply, report = apply, report

    def items(self, system: System) -> list[str]:
        if system.orbit is None:
            return []
        environment = system.environment
        present = is_integrated(system), len(environment.zonals) > 0
        central = [name for name, is_present in zip(NAMES, present, strict=False) if is_present]
        return [*central, *(name for name in NAMES[SUN:] if name in environment.third_bodies)]

    def lower(self, system: System, head: Record, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Table:
        items = self.items(system)
        environment, zonals = system.environment, system.environment.zonals
        strengths = zonals * environment.radius ** np.arange(2, 2 + len(zonals))
        groups = np.array([lowered_points(system, name, pool) for name in system.order], GROUP)
        records = np.zeros(len(items), ITEM)
        for record, name in zip(records, items, strict=True):
            record["kind"], record["n_bodies"] = NAMES.index(name), len(groups)
            record["bodies"] = at + N_ITEM * len(items)
            third = name in THIRD_BODIES
            record["data"] = pool.add([THIRD_BODIES[name], environment.epoch or 0.0] if third else strengths)
            record["highest"] = 1 + len(zonals)
        return np.concatenate([records.view(np.int64).ravel(), groups.view(np.int64).ravel()])

    def without_item(self, system: System, item: str) -> System:
        environment = system.environment
        change: dict[str, Any] = {"third_bodies": tuple(name for name in environment.third_bodies if name != item)}
        if item in NAMES[:SUN]:
            change = {"attraction": "gradient"} if item == NAMES[EXACT] else {"oblateness": (0.0,)}
        return replace(system, environment=environment.model_copy(update=change))


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
