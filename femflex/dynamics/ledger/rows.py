"""Rows of the ledger: inertia forces of velocities by their degree in u, and forces.

Of degree two are Coriolis and centrifugal forces, of degree one M_t u and G u. Forces are elastic ones by degree, those
of joints, gravity, force terms and prescribed motions.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.added_mass import add_added_bias
from femflex.dynamics.bodies.inertia import write_velocity_forces
from femflex.dynamics.bodies.stiffening import add_varying_force, write_varying_stiffness
from femflex.dynamics.bodies.varying import add_flow_forces
from femflex.dynamics.forces.forces import call_apply, clear_forces, clear_joint_forces
from femflex.dynamics.forces.gravity import NO_GRADIENT, find_center_of_mass, gravity_field, local_field
from femflex.dynamics.joints.motion import write_spring_forces
from femflex.dynamics.layout.records import BALL_NONE, ORBIT_NONE, W_OMEGA, W_TAU, body_of, header_of, hold_of, term_of
from femflex.dynamics.rate.gathering import gather_residual
from femflex.dynamics.rate.rate import place_bodies, write_accelerations
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, store3

# rows of the ledger; those of prescribed freedoms follow, then those of the items of force terms
INERTIA, QUADRATIC, LINEAR, SPECIFIED = 0, 1, 2, 3
ELASTIC, QUADRATIC_STRAIN, CUBIC_STRAIN, PRESTRESS, DAMPING = 4, 5, 6, 7, 8
SPRINGS, DAMPERS, GRADIENT, WEIGHT, MOVING, FIRST_PRESCRIBED = 9, 10, 11, 12, 13, 14

# vectors of `spare`: zeros; u and udot of prescribed freedoms alone; udot of others; -u; trial velocities and their h
ZEROS, PRESCRIBED_U, PRESCRIBED_UDOT, FREE_UDOT, BACKWARDS, TRIAL, TRIAL_H, SPARE = 0, 1, 2, 3, 4, 5, 6, 8


@inner
def n_rows(table: Table) -> int:
    """Number of rows of the ledger."""
    head = header_of(table)
    count = FIRST_PRESCRIBED + int(head["n_holds"])
    for i in range(head["n_terms"]):
        count += int(term_of(table, i)["n"])
    return count


@inner
def velocity_row(t: float, q: Array, u: Array, udot: Array, row: Array, table: Table, pool: Array, work: Array) -> None:
    """row = M udot + h of the inertia forces alone at the state (q, u); udot of prescribed freedoms alone."""
    place_bodies(t, q, u, table, pool, work)
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        clear_joint_forces(b, work)
        write_velocity_forces(b, pool, work, NO_GRADIENT, ZERO)
        if b["flows"]:
            add_flow_forces(b, pool, work)
        if b["added"] > 0:
            add_added_bias(b, work)
    gather_residual(udot, row, table, pool, work)


@inner
def write_velocity_rows(
    t: float, q: Array, u: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Rows of h by degree in u: two (Coriolis, centrifugal), one (gyroscopic), zero (specified motion).

    The bodies are left placed at (q, 0), prescribed freedoms moving.
    """
    n_u = header_of(table)["n_u"]
    plus, minus, at_zero = offset(rows, QUADRATIC * n_u), offset(rows, LINEAR * n_u), offset(rows, SPECIFIED * n_u)
    prescribed_u, prescribed_udot, backwards = spare_vectors(spare, n_u)
    for k in range(n_u):
        backwards[k] = 2.0 * prescribed_u[k] - u[k]
    velocity_row(t, q, u, prescribed_udot, plus, table, pool, work)
    velocity_row(t, q, backwards, prescribed_udot, minus, table, pool, work)
    velocity_row(t, q, prescribed_u, prescribed_udot, at_zero, table, pool, work)
    for k in range(n_u):
        even, odd = 0.5 * (plus[k] + minus[k]), 0.5 * (plus[k] - minus[k])
        plus[k], minus[k] = even - at_zero[k], odd


@inner
def spare_vectors(spare: Array, n_u: int) -> tuple[Array, Array, Array]:
    """Return the velocities and accelerations of prescribed freedoms alone, and room for a velocity."""
    return offset(spare, PRESCRIBED_U * n_u), offset(spare, PRESCRIBED_UDOT * n_u), offset(spare, BACKWARDS * n_u)


@inner
def is_free(k: int, table: Table, work: Array) -> bool:
    """Return whether coordinate k is not prescribed."""
    head = header_of(table)
    return head["n_holds"] == 0 or work[head["flags"] + k] == 0.0


@inner
def split_moving_mass(
    t: float, q: Array, u: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Split L u = M_t u + G u, the part of h linear in the free u: M_t = (L + L^T)/2 from the columns of L.

    A row of a prescribed freedom keeps all of it as gyroscopic.
    """
    n_u = header_of(table)["n_u"]
    linear, moving = offset(rows, LINEAR * n_u), offset(rows, MOVING * n_u)
    prescribed_u, prescribed_udot, _ = spare_vectors(spare, n_u)
    trial, plus, minus = offset(spare, TRIAL * n_u), offset(spare, TRIAL_H * n_u), offset(spare, (TRIAL_H + 1) * n_u)
    for k in range(n_u):
        if is_free(k, table, work):
            for j in range(n_u):
                trial[j] = prescribed_u[j]
            trial[k] = 1.0
            velocity_row(t, q, trial, prescribed_udot, plus, table, pool, work)
            trial[k] = -1.0
            velocity_row(t, q, trial, prescribed_udot, minus, table, pool, work)
            transposed = 0.0
            for j in range(n_u):
                if is_free(j, table, work):
                    transposed += 0.5 * (plus[j] - minus[j]) * u[j]
            moving[k] = 0.5 * (linear[k] + transposed)
    for k in range(n_u):
        linear[k] -= moving[k]


@inner
def write_drive_rows(
    t: float, q: Array, u: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write one row for the force of each prescribed freedom, from the recursion."""
    head = header_of(table)
    n_u = head["n_u"]
    write_accelerations(t, q, u, offset(spare, TRIAL * n_u), table, pool, work)
    for j in range(head["n_holds"]):
        k = hold_of(table, j)["u"]
        rows[(FIRST_PRESCRIBED + j) * n_u + k] = -work[head["drives"] + k]


@inner
def matrix_rows(b: Record, columns: int, x: Array, first: int, row: Array, pool: Array) -> None:
    """row[ue + k] = sum_j columns[j, k] x[first + j] on a body's elastic coordinates."""
    for k in range(b["n"]):
        total = 0.0
        for j in range(b["n"]):
            total += pool[columns + j * b["row"] + k] * x[first + j]
        row[b["ue"] + k] = total


@inner
def write_elastic_rows(q: Array, u: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """Rows of K1, K2 and K3 times delta (eq. 8), of the initial stress f0 and of the damping D ddelta."""
    head = header_of(table)
    n_u = head["n_u"]
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        matrix_rows(b, b["stiffness"], q, b["qe"], offset(rows, ELASTIC * n_u), pool)
        matrix_rows(b, b["damping"], u, b["ue"], offset(rows, DAMPING * n_u), pool)
        for k in range(b["n"]):
            rows[PRESTRESS * n_u + b["ue"] + k] = pool[b["f0"] + k]
        if b["nonlinear"]:
            write_varying_stiffness(b, pool, work, 3.0, 0.0)
            add_varying_force(b, work, work, b["delta"], 1.0, rows, QUADRATIC_STRAIN * n_u + b["ue"], 1)
            write_varying_stiffness(b, pool, work, 0.0, 2.0)
            add_varying_force(b, work, work, b["delta"], 1.0, rows, CUBIC_STRAIN * n_u + b["ue"], 1)


@inner
def write_joint_rows(q: Array, u: Array, rows: Array, zeros: Array, table: Table, pool: Array, work: Array) -> None:
    """Rows of joint springs and joint dampers."""
    head = header_of(table)
    springs, dampers = offset(rows, SPRINGS * head["n_u"]), offset(rows, DAMPERS * head["n_u"])
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["sprung"]:
            write_spring_forces(b, q, zeros, pool, work)
            for k in range(b["n_slide"] + b["n_turn"] + (0 if b["ball"] == BALL_NONE else 3)):
                springs[b["u"] + k] = -work[b["work"] + W_TAU + k]
                dampers[b["u"] + k] = pool[b["damper"] + k] * u[b["u"] + k]


@inner
def write_gravity_row(zeros: Array, row: Array, table: Table, pool: Array, work: Array) -> None:
    """Row of gravity, bodies at rest: relative to O (eq. 6), on a free orbit also what moves the centre of mass; or
    of uniform gravity."""
    head = header_of(table)
    clear_forces(table, work)
    l, strength = ZERO, 0.0
    if head["orbit"] != ORBIT_NONE:
        find_center_of_mass(table, pool, work)
        l, strength = gravity_field(table, pool, work)
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        store3(work, b["work"] + W_OMEGA, ZERO)  # what remains of the velocity forces is the field
        field, uniform = local_field(b, head, l, strength, pool, work)
        write_velocity_forces(b, pool, work, field, uniform)
    gather_residual(zeros, row, table, pool, work)


@inner
def write_term_rows(
    t: float, q: Array, u: Array, rows: Array, zeros: Array, table: Table, pool: Array, work: Array
) -> None:
    """Rows of the items of force terms, one each, behind all others."""
    head = header_of(table)
    place_bodies(t, q, u, table, pool, work)
    row = FIRST_PRESCRIBED + head["n_holds"]
    for i in range(head["n_terms"]):
        term = term_of(table, i)
        for k in range(term["n"]):
            clear_forces(table, work)
            call_apply(term["apply"], t, q, u, term["at"], k, k + 1, table, pool, work)
            gather_residual(zeros, offset(rows, row * head["n_u"]), table, pool, work)
            row += 1
