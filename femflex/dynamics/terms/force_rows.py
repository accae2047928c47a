"""Rows of forces: elastic forces by degree, joints, gravity, force terms, prescribed motions."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.inertia import write_velocity_forces
from femflex.dynamics.bodies.stiffening import add_varying_force, write_varying_stiffness
from femflex.dynamics.forces.calls import call_apply
from femflex.dynamics.forces.gravity import find_center_of_mass, gravity_field, local_field
from femflex.dynamics.forces.system import clear_forces
from femflex.dynamics.joints.forces import write_spring_forces
from femflex.dynamics.lowering.layout import BALL_NONE, ORBIT_NONE, W_OMEGA, W_TAU, body_of, header_of, hold_of, term_of
from femflex.dynamics.motion.equations import place_bodies, write_accelerations
from femflex.dynamics.motion.gathering import gather_residual
from femflex.dynamics.terms.rows import (
    CUBIC_STRAIN,
    DAMPERS,
    DAMPING,
    ELASTIC,
    FIRST_PRESCRIBED,
    PRESTRESS,
    QUADRATIC_STRAIN,
    SPRINGS,
    TRIAL,
)
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, store3


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
