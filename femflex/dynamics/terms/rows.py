"""Layout of the rows of the ledger of terms, and the vectors of its spare room."""

from __future__ import annotations

from femflex.arrays import Table
from femflex.dynamics.lowering.layout import header_of, term_of
from femflex.kernels.compiled import inner

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
