"""Rows A u = b that a user's function writes: they are copied into the work array and used as they are."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.constraints.contact_rows import put_values
from femflex.dynamics.lowering import constraint_layout as layout
from femflex.dynamics.lowering.layout import header_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import call_user
from femflex.kernels.lanes import offset


@inner
def write_general(t: float, q: Array, u: Array, c: Record, row: int, table: Table, work: Array) -> None:
    """The user's rows: A, b and the bias as the function left them."""
    n_rows, n_u, g = c["n_rows"], header_of(table)["n_u"], c["general"]
    call_user(c["function"], t, q, u, offset(work, g))
    b = g + n_rows * n_u
    for k in range(n_rows):
        r = row + layout.ROW_SIZE * k
        for j in range(12):
            work[r + j] = 0.0
        work[r + layout.R_SPEED] = general_row_times(c, k, u, table, work) - work[b + k]
        put_values(r, 0.0, work[b + n_rows + k], work)


@inner
def general_row_times(c: Record, k: int, v: Array, table: Table, work: Array) -> float:
    """Row k of a general constraint times v (n_u)."""
    n_u = header_of(table)["n_u"]
    total = 0.0
    for j in range(n_u):
        total += work[c["general"] + k * n_u + j] * v[j]
    return total
