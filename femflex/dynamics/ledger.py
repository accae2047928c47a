"""The terms of eq. (9) one by one, compiled: which source moves, holds or brakes each coordinate.

Every term is written as it stands on the left of M udot + h - Q = 0, so that all of them sum to zero. h splits by its
degree in u (THEORY section 4), from inertia forces alone, at u, -u and 0; everything else is evaluated by itself, with
nothing else there to cancel against. Compiled apart from `rate`, and only when first asked for.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from femflex.dynamics.equations import place
from femflex.dynamics.forces import apply_load, find_center_of_mass, gravity_field, local_field, write_spring_forces
from femflex.dynamics.inertia import write_velocity_forces, zero_forces
from femflex.dynamics.kinematics import coordinate_rates
from femflex.dynamics.layout import (
    BALL_NONE,
    ORBIT_NONE,
    W_BIAS,
    W_OMEGA,
    W_TAU,
    bodies_of,
    header_of,
    loads_of,
)
from femflex.dynamics.second_order import RESIDUAL, gather_residual, solve
from femflex.dynamics.turns import ZERO
from femflex.dynamics.vectors import Matrix, inner, store3

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void

# rows of the ledger; loads follow in the system's order
INERTIA, QUADRATIC, LINEAR, SPECIFIED = 0, 1, 2, 3
ELASTIC, PRESTRESS, DAMPING, SPRINGS, DAMPERS, GRAVITY, FIRST_LOAD = 4, 5, 6, 7, 8, 9, 10

NO_FIELD: Matrix = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

_vector, _matrix = types.float64[::1], types.float64[:, ::1]
_own = (types.int64[::1], _vector, _vector)  # table, pool, work
RATE = types.void(types.float64, _vector, _vector, *_own)
LEDGER = types.void(_vector, _matrix, _matrix, types.float64[:, :, ::1], *_own)


@inner
def clear(table: Table, work: Array) -> None:
    """Leave the placed bodies without forces, joint forces and bias accelerations."""
    bodies = bodies_of(table)
    for i in range(1, len(bodies)):
        zero_forces(bodies[i], work)
        for k in range(6):
            work[bodies[i]["work"] + W_BIAS + k] = 0.0
            work[bodies[i]["work"] + W_TAU + k] = 0.0


@inner
def velocity_row(t: float, x: Array, still: Array, row: Array, table: Table, pool: Array, work: Array) -> None:
    """row = h of the inertia forces alone at the state x; `still` is a zero udot."""
    bodies = bodies_of(table)
    nq = header_of(table)["n_q"]
    place(t, x, table, pool, work)
    for i in range(1, len(bodies)):
        write_velocity_forces(bodies[i], x, nq, pool, work, NO_FIELD, ZERO)
    gather_residual(still, row, table, pool, work)


@inner
def write_velocity_rows(t: float, x: Array, still: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """Rows of h by degree in u: two (Coriolis, centrifugal), one (gyroscopic), zero (specified motion).

    The bodies are left placed at (q, 0).
    """
    nq = header_of(table)["n_q"]
    plus, minus, none = rows[QUADRATIC], rows[LINEAR], rows[SPECIFIED]
    y = x.copy()
    velocity_row(t, y, still, plus, table, pool, work)
    y[nq:] = -x[nq:]
    velocity_row(t, y, still, minus, table, pool, work)
    y[nq:] = 0.0
    velocity_row(t, y, still, none, table, pool, work)
    for k in range(len(still)):
        even, odd = 0.5 * (plus[k] + minus[k]), 0.5 * (plus[k] - minus[k])
        plus[k], minus[k] = even - none[k], odd


@inner
def matrix_rows(b: Record, matrix: int, x: Array, first: int, row: Array, pool: Array) -> None:
    """row[ue + k] = sum_j matrix[k, j] x[first + j] on a body's elastic coordinates."""
    n = b["n"]
    for k in range(n):
        total = 0.0
        for j in range(n):
            total += pool[matrix + k * n + j] * x[first + j]
        row[b["ue"] + k] = total


@inner
def write_elastic_rows(x: Array, rows: Array, table: Table, pool: Array) -> None:
    """Rows of V1 delta (eq. 8), of the initial stress f0 and of the damping D ddelta."""
    bodies = bodies_of(table)
    nq = header_of(table)["n_q"]
    for i in range(1, len(bodies)):
        b = bodies[i]
        matrix_rows(b, b["stiffness"], x, b["qe"], rows[ELASTIC], pool)
        matrix_rows(b, b["damping"], x, nq + b["ue"], rows[DAMPING], pool)
        for k in range(b["n"]):
            rows[PRESTRESS, b["ue"] + k] = pool[b["f0"] + k]


@inner
def write_joint_rows(x: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """Rows of joint springs and joint dampers."""
    bodies = bodies_of(table)
    nq = header_of(table)["n_q"]
    at_rest = x.copy()
    at_rest[nq:] = 0.0
    for i in range(1, len(bodies)):
        b = bodies[i]
        if b["sprung"]:
            write_spring_forces(b, at_rest, nq, pool, work)
            for k in range(b["n_slide"] + b["n_turn"] + (0 if b["ball"] == BALL_NONE else 3)):
                rows[SPRINGS, b["u"] + k] = -work[b["work"] + W_TAU + k]
                rows[DAMPERS, b["u"] + k] = pool[b["damper"] + k] * x[nq + b["u"] + k]


@inner
def write_gravity_row(x: Array, still: Array, row: Array, table: Table, pool: Array, work: Array) -> None:
    """Row of gravity relative to O: the gradient of eq. (6); in a free orbit also what moves the centre of mass."""
    bodies, head = bodies_of(table), header_of(table)
    at_rest = x.copy()
    at_rest[head["n_q"] :] = 0.0
    clear(table, work)
    find_center_of_mass(table, pool, work)
    gradient, strength = gravity_field(table, pool, work)
    for i in range(1, len(bodies)):
        b = bodies[i]
        store3(work, b["work"] + W_OMEGA, ZERO)  # what remains of the velocity forces is the field
        field, uniform = local_field(b, head, gradient, strength, work)
        write_velocity_forces(b, at_rest, head["n_q"], pool, work, field, uniform)
    gather_residual(still, row, table, pool, work)


@inner
def write_terms(t: float, x: Array, udot: Array, rows: Array, table: Table, pool: Array, work: Array) -> None:
    """rows (n_terms, n_u): every term at the state x with the accelerations udot (n_u,)."""
    bodies, loads, head = bodies_of(table), loads_of(table), header_of(table)
    still = np.zeros(udot.size)
    rows[:] = 0.0
    write_velocity_rows(t, x, still, rows, table, pool, work)
    write_elastic_rows(x, rows, table, pool)
    write_joint_rows(x, rows, table, pool, work)
    clear(table, work)
    gather_residual(udot, rows[INERTIA], table, pool, work)
    for j in range(len(loads)):
        clear(table, work)
        apply_load(t, loads[j], bodies, head, x, pool, work)
        gather_residual(still, rows[FIRST_LOAD + j], table, pool, work)
    if head["orbit"] != ORBIT_NONE:
        write_gravity_row(x, still, rows[GRAVITY], table, pool, work)


@njit(LEDGER, cache=True)
def ledger(times: Array, states: Array, rates: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out (n_t, n_terms, n_u): all terms at times (n_t,), states (n_t, n_x) and accelerations (n_t, n_u)."""
    for j in range(len(times)):
        write_terms(times[j], states[j], rates[j], out[j], table, pool, work)


@njit(RESIDUAL, cache=True)
def reduced_residual(
    t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array
) -> None:
    """out = M udot + h - Q with the terms that the header's `kept` leaves."""
    head = header_of(table)
    x = np.empty(head["n_q"] + head["n_u"])
    x[: head["n_q"]] = q
    x[head["n_q"] :] = u
    rows = np.empty((FIRST_LOAD + head["n_loads"], head["n_u"]))
    write_terms(t, x, udot, rows, table, pool, work)
    out[:] = 0.0
    for i in range(len(rows)):
        if pool[head["kept"] + i] != 0.0:
            for k in range(len(out)):
                out[k] += rows[i, k]


@njit(RATE, cache=True)
def reduced_rate(t: float, x: Array, dx: Array, table: Table, pool: Array, work: Array) -> None:
    """dx/dt of a model from which terms have been left out; some five times the cost of `rate`."""
    bodies = bodies_of(table)
    head = header_of(table)
    nq, n_u = head["n_q"], head["n_u"]
    q, u, bias = x[:nq], x[nq:], np.empty(n_u)
    reduced_residual(t, q, u, np.zeros(n_u), bias, table, pool, work)
    for k in range(n_u):
        bias[k] = -bias[k]
    solve(t, q, bias, dx[nq:], 1.0, 0.0, 0.0, table, pool, work)
    for i in range(1, len(bodies)):
        coordinate_rates(bodies[i], q, u, dx, pool)
