"""The terms of eq. (9) one by one, compiled: which source moves, holds or brakes each coordinate.

Every term is written as it stands on the left of M udot + h - Q = 0, so that all of them sum to zero. h splits by its
degree in u (THEORY section 4), from inertia forces alone, at u, -u and 0; everything else is evaluated by itself, with
nothing else there to cancel against. Compiled apart from `rate`, and only when first asked for.

The degree in u counts free coordinates alone: held ones move as specified throughout, and their sddot belongs to the
specified motion.

Rows (n_terms, n_u) lie flat; `spare` (SPARE n_u) is room for vectors (n_u,): a system at rest, what held freedoms do,
and trial velocities.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import inner, kernel
from femflex.dynamics.arithmetic.lanes import beyond, start
from femflex.dynamics.arithmetic.symbols import types
from femflex.dynamics.arithmetic.vectors import ZERO, store3
from femflex.dynamics.bodies.inertia import write_velocity_forces
from femflex.dynamics.bodies.stiffening import add_varying_force, write_varying_stiffness
from femflex.dynamics.forces.gravity import NO_GRADIENT, find_center_of_mass, gravity_field, local_field
from femflex.dynamics.forces.loads import apply_load
from femflex.dynamics.forces.springs import apply_spring
from femflex.dynamics.forces.system import clear, release_joint
from femflex.dynamics.joints.forces import write_spring_forces
from femflex.dynamics.joints.held import held_state
from femflex.dynamics.joints.laws import write_law_rows
from femflex.dynamics.lowering.layout import BALL_NONE, ORBIT_NONE, W_OMEGA, W_TAU, body_of, header_of, hold_of, load_of
from femflex.dynamics.lowering.tie_layout import spring_of
from femflex.dynamics.motion.equations import place
from femflex.dynamics.motion.gathering import gather_residual
from femflex.dynamics.motion.led_equations import write_accelerations

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void

# rows of the ledger; loads follow in the system's order
INERTIA, QUADRATIC, LINEAR, SPECIFIED = 0, 1, 2, 3
ELASTIC, QUADRATIC_STRAIN, CUBIC_STRAIN, PRESTRESS, DAMPING = 4, 5, 6, 7, 8
SPRINGS, DAMPERS, GRADIENT, WEIGHT, MOVING, FIRST_LOAD = 9, 10, 11, 12, 13, 14


# vectors of `spare`: zeros; u and udot of held freedoms alone; udot of the others; -u; trial velocities and their h
ZEROS, HELD_U, HELD_UDOT, FREE_UDOT, BACKWARDS, TRIAL, TRIAL_H, SPARE = 0, 1, 2, 3, 4, 5, 6, 8

_vector, _matrix = types.float64[::1], types.float64[:, ::1]
LEDGER = types.void(_vector, _matrix, _matrix, _matrix, types.int64[::1], _vector, _vector)


@inner
def velocity_row(t: float, q: Array, u: Array, udot: Array, row: Array, table: Table, pool: Array, work: Array) -> None:
    """row = M udot + h of the inertia forces alone at the state (q, u); udot of held freedoms alone."""
    place(t, q, u, table, pool, work)
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        release_joint(b, work)
        write_velocity_forces(b, pool, work, NO_GRADIENT, ZERO)
    gather_residual(udot, row, table, pool, work)


@inner
def write_velocity_rows(
    t: float, q: Array, u: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Rows of h by degree in u: two (Coriolis, centrifugal), one (gyroscopic), zero (specified motion).

    The bodies are left placed at (q, 0), held freedoms moving.
    """
    n_u = header_of(table)["n_u"]
    plus, minus, none = beyond(rows, QUADRATIC * n_u), beyond(rows, LINEAR * n_u), beyond(rows, SPECIFIED * n_u)
    rest, known, backwards = spare_vectors(spare, n_u)
    for k in range(n_u):
        backwards[k] = 2.0 * rest[k] - u[k]
    velocity_row(t, q, u, known, plus, table, pool, work)
    velocity_row(t, q, backwards, known, minus, table, pool, work)
    velocity_row(t, q, rest, known, none, table, pool, work)
    for k in range(n_u):
        even, odd = 0.5 * (plus[k] + minus[k]), 0.5 * (plus[k] - minus[k])
        plus[k], minus[k] = even - none[k], odd


@inner
def spare_vectors(spare: Array, n_u: int) -> tuple[Array, Array, Array]:
    """Velocities and accelerations of held freedoms alone, and room for a velocity."""
    return beyond(spare, HELD_U * n_u), beyond(spare, HELD_UDOT * n_u), beyond(spare, BACKWARDS * n_u)


@inner
def split_moving_mass(
    t: float, q: Array, u: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Split L u = M_t u + G u, the part of h linear in the free u: M_t = (L + L^T)/2 from the columns of L.

    A row of a held freedom keeps all of it as gyroscopic.
    """
    head = header_of(table)
    n_u, flags = head["n_u"], head["flags"]
    linear, moving = beyond(rows, LINEAR * n_u), beyond(rows, MOVING * n_u)
    rest, known, _ = spare_vectors(spare, n_u)
    trial, plus, minus = beyond(spare, TRIAL * n_u), beyond(spare, TRIAL_H * n_u), beyond(spare, (TRIAL_H + 1) * n_u)
    for k in range(n_u):
        if work[flags + k] == 0.0:
            for j in range(n_u):
                trial[j] = rest[j]
            trial[k] = 1.0
            velocity_row(t, q, trial, known, plus, table, pool, work)
            trial[k] = -1.0
            velocity_row(t, q, trial, known, minus, table, pool, work)
            transposed = 0.0
            for j in range(n_u):
                if work[flags + j] == 0.0:
                    transposed += 0.5 * (plus[j] - minus[j]) * u[j]
            moving[k] = 0.5 * (linear[k] + transposed)
    for k in range(n_u):
        linear[k] -= moving[k]


@inner
def write_drive_rows(
    t: float, q: Array, u: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Rows of the forces that hold freedoms, from the recursion: one row per hold, after the loads."""
    head = header_of(table)
    n_u = head["n_u"]
    write_accelerations(t, q, u, beyond(spare, TRIAL * n_u), table, pool, work)
    for j in range(head["n_holds"]):
        k = hold_of(table, j)["u"]
        rows[(FIRST_LOAD + head["n_loads"] + j) * n_u + k] = -work[head["drives"] + k]


@inner
def split_held(u: Array, udot: Array, spare: Array, table: Table, work: Array) -> None:
    """Write into `spare` zeros, what held freedoms do by themselves, and the accelerations of the others."""
    head = header_of(table)
    n_u = head["n_u"]
    for k in range(n_u):
        held = head["n_holds"] > 0 and work[head["flags"] + k] != 0.0
        spare[ZEROS * n_u + k] = 0.0
        spare[HELD_U * n_u + k] = u[k] if held else 0.0
        spare[HELD_UDOT * n_u + k] = work[head["known"] + k] if held else 0.0
        spare[FREE_UDOT * n_u + k] = 0.0 if held else udot[k]


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
        matrix_rows(b, b["stiffness"], q, b["qe"], beyond(rows, ELASTIC * n_u), pool)
        matrix_rows(b, b["damping"], u, b["ue"], beyond(rows, DAMPING * n_u), pool)
        for k in range(b["n"]):
            rows[PRESTRESS * n_u + b["ue"] + k] = pool[b["f0"] + k]
        if b["nonlinear"]:
            write_varying_stiffness(b, pool, work, 3.0, 0.0)
            add_varying_force(b, work, work, b["delta"], 1.0, rows, QUADRATIC_STRAIN * n_u + b["ue"], 1)
            write_varying_stiffness(b, pool, work, 0.0, 2.0)
            add_varying_force(b, work, work, b["delta"], 1.0, rows, CUBIC_STRAIN * n_u + b["ue"], 1)


@inner
def write_joint_rows(q: Array, u: Array, rows: Array, still: Array, table: Table, pool: Array, work: Array) -> None:
    """Rows of joint springs and joint dampers."""
    head = header_of(table)
    springs, dampers = beyond(rows, SPRINGS * head["n_u"]), beyond(rows, DAMPERS * head["n_u"])
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["sprung"]:
            write_spring_forces(b, q, still, pool, work)
            for k in range(b["n_slide"] + b["n_turn"] + (0 if b["ball"] == BALL_NONE else 3)):
                springs[b["u"] + k] = -work[b["work"] + W_TAU + k]
                dampers[b["u"] + k] = pool[b["damper"] + k] * u[b["u"] + k]


@inner
def write_gravity_row(still: Array, row: Array, table: Table, pool: Array, work: Array) -> None:
    """Row of gravity, bodies at rest: relative to O (eq. 6), on a free orbit also what moves the centre of mass; or
    of uniform gravity."""
    head = header_of(table)
    clear(table, work)
    l, strength = ZERO, 0.0
    if head["orbit"] != ORBIT_NONE:
        find_center_of_mass(table, pool, work)
        l, strength = gravity_field(table, pool, work)
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        store3(work, b["work"] + W_OMEGA, ZERO)  # what remains of the velocity forces is the field
        field, uniform = local_field(b, head, l, strength, pool, work)
        write_velocity_forces(b, pool, work, field, uniform)
    gather_residual(still, row, table, pool, work)


@inner
def write_spring_rows(
    t: float, q: Array, u: Array, rows: Array, still: Array, table: Table, pool: Array, work: Array
) -> None:
    """Rows of springs between markers, one each, behind all others."""
    head = header_of(table)
    place(t, q, u, table, pool, work)
    for i in range(head["n_springs"]):
        clear(table, work)
        apply_spring(spring_of(table, i), table, pool, work)
        gather_residual(still, beyond(rows, (n_rows(table) - head["n_springs"] + i) * head["n_u"]), table, pool, work)


@inner
def write_terms(
    t: float, q: Array, u: Array, udot: Array, rows: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """rows (n_terms, n_u): every term at the state (q, u) with the accelerations udot (n_u,)."""
    head = header_of(table)
    n_u = head["n_u"]
    for k in range(n_rows(table) * n_u):
        rows[k] = 0.0
    if head["n_holds"] > 0:
        q, u = held_state(t, q, u, table, pool, work)
    split_held(u, udot, spare, table, work)
    if head["n_holds"] > 0:
        write_drive_rows(t, q, u, rows, spare, table, pool, work)
    if head["n_springs"] > 0:
        write_spring_rows(t, q, u, rows, spare, table, pool, work)
    write_velocity_rows(t, q, u, rows, spare, table, pool, work)
    write_elastic_rows(q, u, rows, table, pool, work)
    write_joint_rows(q, u, rows, spare, table, pool, work)
    clear(table, work)
    gather_residual(beyond(spare, FREE_UDOT * n_u), beyond(rows, INERTIA * n_u), table, pool, work)
    for j in range(head["n_loads"]):
        clear(table, work)
        apply_load(t, load_of(table, j), table, pool, work)
        gather_residual(spare, beyond(rows, (FIRST_LOAD + j) * n_u), table, pool, work)
    if head["orbit"] != ORBIT_NONE:
        write_gravity_row(spare, beyond(rows, GRADIENT * n_u), table, pool, work)
    if head["weighs"]:
        write_gravity_row(spare, beyond(rows, WEIGHT * n_u), table, pool, work)
    laws = FIRST_LOAD + head["n_loads"] + head["n_holds"]
    if head["n_laws"] > 0:
        write_law_rows(q, u, beyond(rows, laws * n_u), table, pool)
    if head["n_holds"] > 0:
        split_moving_mass(t, q, u, rows, spare, table, pool, work)


@inner
def n_rows(table: Table) -> int:
    """Number of rows of the ledger."""
    head = header_of(table)
    behind = int(head["n_holds"]) + int(head["law_rows"]) + int(head["n_springs"])
    return FIRST_LOAD + int(head["n_loads"]) + behind


@inner
def write_rows_of_run(
    times: Array, states: Array, rates: Array, out: Array, spare: Array, table: Table, pool: Array, work: Array
) -> None:
    """Rows of every instant of a run; what `spare` points to is held by the caller."""
    for j in range(len(times)):
        q = start(states[j])
        u = beyond(q, header_of(table)["n_q"])
        write_terms(times[j], q, u, start(rates[j]), start(out[j]), start(spare), table, pool, work)


@kernel(LEDGER)
def ledger(times: Array, states: Array, rates: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out (n_t, n_terms n_u): all terms at times (n_t,), states (n_t, n_x) and accelerations (n_t, n_u)."""
    spare = np.zeros(SPARE * rates.shape[1])
    write_rows_of_run(times, states, rates, out, spare, start(table), start(pool), start(work))
