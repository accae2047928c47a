"""The residual of the equations of motion, and the linear solve with their matrices, as calls."""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.motion.gathering import write_residual, write_solution
from femflex.dynamics.motion.second_order import RESIDUAL, SOLVE
from femflex.kernels.compiled import kernel
from femflex.kernels.lanes import pointer


@kernel(RESIDUAL)
def residual(t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = M(q, t) udot + h(q, u, t) - Q of eq. (9), in O(n).

    With an eliminated root translation M is M - M_v^T M_vv^-1 M_v and forces work through displacements relative to O.
    """
    write_residual(
        t,
        pointer(q),
        pointer(u),
        pointer(udot),
        pointer(out),
        pointer(table),
        pointer(pool),
        pointer(work),
    )


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
