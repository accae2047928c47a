"""Forces in the joints of a constrained motion: the equations summed from the tips, with constraint forces.

Compiled apart from `constraints`, and only at the first request.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.equations import solve_motion
from femflex.dynamics.constraints.rows import push_row, row_of
from femflex.dynamics.forces.system import write_forces
from femflex.dynamics.forces.work_per_length import clear_work_per_length
from femflex.dynamics.joints.prescribed_motion import prescribed_state, write_prescribed_rows
from femflex.dynamics.lowering import constraint_layout as layout
from femflex.dynamics.lowering.constraint_layout import closing_of, constraint_of
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.motion.equations import place_bodies
from femflex.dynamics.motion.gathering import gather_residual
from femflex.dynamics.motion.second_order import RESIDUAL
from femflex.kernels.compiled import inner, kernel
from femflex.kernels.lanes import offset, pointer


@inner
def push_rows(table: Table, work: Array) -> None:
    """Put the forces of all constraints between markers on their bodies."""
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        if c["kind"] != layout.CONSTRAINT_GENERAL:
            for k in range(c["n_rows"]):
                r = row_of(table, c["first"] + k)
                push_row(c, r, work[r + layout.R_LAMBDA], table, work)


@inner
def subtract_general(out: Array, table: Table, work: Array) -> None:
    """Subtract the forces of general rows."""
    n_u = header_of(table)["n_u"]
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        if c["kind"] == layout.CONSTRAINT_GENERAL:
            for k in range(c["n_rows"]):
                factor = work[row_of(table, c["first"] + k) + layout.R_LAMBDA]
                for j in range(n_u):
                    out[j] -= factor * work[c["general"] + k * n_u + j]


@inner
def write_constrained_residual(
    t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array
) -> None:
    """Write M udot + h - Q - A^T lambda to out; W_P has the force that every joint carries."""
    head = header_of(table)
    copy_auxiliary_states(u, table, work)
    if head["n_holds"] > 0:
        q, u = prescribed_state(t, q, u, table, pool, work)
    solve_motion(t, q, u, offset(work, closing_of(table)["free"]), table, pool, work)
    clear_work_per_length(table, pool)
    place_bodies(t, q, u, table, pool, work)
    write_forces(t, q, u, table, pool, work)
    push_rows(table, work)
    gather_residual(udot, out, table, pool, work)
    subtract_general(out, table, work)
    if head["n_holds"] > 0:
        prescribed_state(t, q, u, table, pool, work)
        write_prescribed_rows(udot, out, table, work)


@kernel(RESIDUAL)
def residual(t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = M udot + h - Q - A^T lambda of eq. (9), as write_constrained_residual."""
    write_constrained_residual(
        t, pointer(q), pointer(u), pointer(udot), pointer(out), pointer(table), pointer(pool), pointer(work)
    )
