"""The constrained equations of motion as implicit integrators ask for them, and what joints carry.

The multipliers are those of the motion itself, lambda(t, q, u) from A udot = bdot - Adot u, so that the residual
M udot + h - Q - A^T lambda = M (udot - udot*) vanishes at the accelerations udot* of `constraints.rate`. Drift is the
integrator's to take away, by `project`. Compiled apart from `constraints`, and only when first asked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics import constraint_layout as at
from femflex.dynamics.compiled import inner, kernel
from femflex.dynamics.constraint_layout import closing_of, constraint_of
from femflex.dynamics.constraints import solve_motion
from femflex.dynamics.equations import place
from femflex.dynamics.forces import clear, write_forces
from femflex.dynamics.gathering import gather_residual
from femflex.dynamics.held import held_state, hold_rows
from femflex.dynamics.lanes import beyond, start
from femflex.dynamics.layout import header_of
from femflex.dynamics.multipliers import factorise_products, multipliers
from femflex.dynamics.recursion import reduce_to_root
from femflex.dynamics.row_reduction import respond, whiten_forces, whiten_rows
from femflex.dynamics.rows import push_row, row_of, write_rows
from femflex.dynamics.second_order import RESIDUAL, SOLVE

Array = NDArray[np.float64]
Table = NDArray[np.int64]


@inner
def push_rows(table: Table, work: Array) -> None:
    """Put the forces of all constraints between markers on their bodies."""
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        if c["kind"] != at.CONSTRAINT_GENERAL:
            for k in range(c["n_rows"]):
                r = row_of(table, c["first"] + k)
                push_row(c, r, work[r + at.R_LAMBDA], table, work)


@inner
def subtract_general(out: Array, table: Table, work: Array) -> None:
    """Subtract the forces of general rows."""
    n_u = header_of(table)["n_u"]
    for i in range(closing_of(table)["n_constraints"]):
        c = constraint_of(table, i)
        if c["kind"] == at.CONSTRAINT_GENERAL:
            for k in range(c["n_rows"]):
                factor = work[row_of(table, c["first"] + k) + at.R_LAMBDA]
                for j in range(n_u):
                    out[j] -= factor * work[c["general"] + k * n_u + j]


@inner
def write_constrained_residual(
    t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array
) -> None:
    """out = M udot + h - Q - A^T lambda; W_P keeps what every joint carries."""
    head = header_of(table)
    if head["n_holds"] > 0:
        q, u = held_state(t, q, u, table, pool, work)
    solve_motion(t, q, u, beyond(work, closing_of(table)["free"]), table, pool, work)
    place(t, q, u, table, pool, work)
    write_forces(t, q, u, table, pool, work)
    push_rows(table, work)
    gather_residual(udot, out, table, pool, work)
    subtract_general(out, table, work)
    if head["n_holds"] > 0:
        held_state(t, q, u, table, pool, work)
        hold_rows(udot, out, table, work)


@kernel(RESIDUAL)
def residual(t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = M udot + h - Q - A^T lambda of eq. (9), as write_constrained_residual."""
    write_constrained_residual(t, start(q), start(u), start(udot), start(out), start(table), start(pool), start(work))


@inner
def add_products(sign: float, table: Table, work: Array) -> None:
    """Add sign A S^-1 f of the whitened forces f to the rows' right sides."""
    closing = closing_of(table)
    width, forces = closing["width"], beyond(work, closing["white"] + closing["width"] * closing["n_rows"])
    for i in range(closing["n_rows"]):
        white = beyond(work, closing["white"] + width * i)
        total = 0.0
        for k in range(width):
            total += white[k] * forces[k]
        work[row_of(table, i) + at.R_TARGET] += sign * total


@inner
def write_constrained_solution(
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
    """out of (S + M P M^-1 G) out = rhs / c_m with P the projection along constraint forces and G = S - M.

    S out - A^T nu = rhs and A out = A M^-1 rhs: the white rows by M first, then by S = M + c_d/c_m D + c_k/c_m K.
    Held freedoms take rhs / c_m.
    """
    head = header_of(table)
    scaled = beyond(work, closing_of(table)["free"])
    for i in range(head["n_u"]):
        scaled[i] = rhs[i] / c_m
    u = rhs
    if head["n_holds"] > 0:
        q, u = held_state(t, q, rhs, table, pool, work)
    place(t, q, u, table, pool, work)
    write_rows(t, q, u, table, pool, work)
    for i in range(closing_of(table)["n_rows"]):
        work[row_of(table, i) + at.R_TARGET] = 0.0
    stiff = False
    for part in range(2):
        d, k = float(part) * c_d / c_m, float(part) * c_k / c_m
        stiff = d != 0.0 or k != 0.0
        clear(table, work)
        reduce_to_root(table, pool, work, d, k, True)
        whiten_rows(table, work, stiff)
        whiten_forces(scaled, table, work, stiff)
        add_products(1.0 if part == 0 else -1.0, table, work)
    factorise_products(table, pool, work)
    multipliers(table, work)
    respond(table, work, out, stiff, True)
    if head["n_holds"] > 0:
        for i in range(head["n_u"]):
            if work[head["flags"] + i] != 0.0:
                out[i] = scaled[i]


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
    """out = correction of udot for a residual -rhs, as write_constrained_solution."""
    write_constrained_solution(
        t, start(q), start(rhs), start(out), c_m, c_d, c_k, start(table), start(pool), start(work)
    )
