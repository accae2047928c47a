"""The residual of the equations of motion, and the linear solve with their matrices, as calls."""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.rows import push_rows, subtract_general
from femflex.dynamics.forces.system import write_forces
from femflex.dynamics.joints.prescribed_motion import prescribed_state, write_prescribed_rows
from femflex.dynamics.lowering import constraint_layout as layout
from femflex.dynamics.lowering.constraint_layout import closing_of
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.motion.auxiliary_states import copy_auxiliary_states
from femflex.dynamics.motion.equations import place_bodies
from femflex.dynamics.motion.gathering import gather_residual, write_solution
from femflex.dynamics.motion.second_order import RESIDUAL, SOLVE
from femflex.kernels.compiled import kernel
from femflex.kernels.lanes import pointer


@kernel(RESIDUAL)
def residual(t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = M(q, t) udot + h(q, u, t) - Q of eq. (9), in O(n); out = udot - sddot on the rows of prescribed freedoms.

    W_P has the force that every joint carries. With an eliminated root translation M is M - M_v^T M_vv^-1 M_v and
    forces work through displacements relative to O. Where the task is TASK_PUSH the forces A^T lambda of constraints
    count, with the multipliers that were solved for last.
    """
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    x, v, rates, forces = pointer(q), pointer(u), pointer(udot), pointer(out)
    head, closing = header_of(records), closing_of(records)
    pushed = closing["n_constraints"] > 0 and scratch[closing["task"]] == layout.TASK_PUSH
    copy_auxiliary_states(v, records, scratch)
    if head["n_holds"] > 0:
        x, v = prescribed_state(t, x, v, records, numbers, scratch)
    place_bodies(t, x, v, records, numbers, scratch)
    write_forces(t, x, v, records, numbers, scratch)
    if pushed:
        push_rows(records, scratch)
    gather_residual(rates, forces, records, numbers, scratch)
    if pushed:
        subtract_general(forces, records, scratch)
    if head["n_holds"] > 0:
        write_prescribed_rows(rates, forces, records, scratch)


@kernel(SOLVE)
def solve(
    t: float,
    q: Array,
    rhs: Array,
    out: Array,
    c_m: float,
    c_d: float,
    c_k: float,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """out = (c_m M + c_d D + c_k K)^-1 rhs with M at q, D and K of shapes, springs and dampers; O(n)."""
    write_solution(
        t,
        pointer(q),
        pointer(rhs),
        pointer(out),
        c_m,
        c_d,
        c_k,
        pointer(table),
        pointer(pool),
        pointer(work),
    )
