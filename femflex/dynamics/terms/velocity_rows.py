"""Rows of the inertia forces of velocities, by their degree in u: two, one (M_t u and G u) and zero."""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.bodies.flow import add_flow_forces
from femflex.dynamics.bodies.inertia import write_velocity_forces
from femflex.dynamics.forces.gravity import NO_GRADIENT
from femflex.dynamics.forces.system import clear_joint_forces
from femflex.dynamics.lowering.layout import body_of, header_of
from femflex.dynamics.motion.equations import place_bodies
from femflex.dynamics.motion.gathering import gather_residual
from femflex.dynamics.terms.rows import (
    BACKWARDS,
    LINEAR,
    MOVING,
    PRESCRIBED_U,
    PRESCRIBED_UDOT,
    QUADRATIC,
    SPECIFIED,
    TRIAL,
    TRIAL_H,
)
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO


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
