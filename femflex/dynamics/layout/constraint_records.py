"""Records of constraints besides the tree: constraints (loops, nonholonomic).

They stand behind all other records of the table, where the header's `closing` says: first one CLOSING record, then the
CONSTRAINT records. A row of a constraint has its place in the work array.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Table
from femflex.dynamics.layout.records import header_of, header_record, record_reader
from femflex.kernels.compiled import inner

CLOSING = np.dtype(
    [
        (name, "i8")
        for name in (
            "n_constraints",
            "task",  # work: TASK_*, of `project` and the residual
            "n_rows",  # of all constraints
            "n_hidden",  # eliminated translations, 0 or 3
            "width",  # n_u + n_hidden
            # pool: position residual to which a state is brought back, size of the bodies [m]; part of the longest row
            "tolerance",  # below which a row depends on others
            "note",  # work (NOTE_SIZE): the worst row of the last state that was brought back
            "rows",  # work: ROW_SIZE per row
            "white",  # work (n_rows, width): D^-1/2 L^-1 a of each row a, with M = L D L^T
            "roots",  # work (width): D^-1/2
            "small",
            "basis",  # work: see `multipliers`
            "moved_by",  # work (width): the white rows' sum, each times its multiplier
            "step",  # work (n_u): a change of u or an increment of q
            "free",  # work (n_u): accelerations
            "moved",  # work (n_q)
            "marks",  # work (n_bodies): bodies between a row's markers and the root
        )
    ]
)

ENDS = (
    "parent", "child",  # bodies of markers P and Q; parent 0 is the base frame
    "place_P", "shape_P", "spin_P", "bends_P",  # as for marker P of a joint
    "place_Q", "shape_Q", "spin_Q", "bends_Q",
)  # fmt: skip

CONSTRAINT = np.dtype(
    [
        (name, "i8")
        for name in (
            *ENDS,
            "kind",  # CONSTRAINT_*
            "motion_P", "motion_Q",  # work: M_*
            "n_slides", "slides",  # pool (n_slides, 4)
            "n_pairs", "pairs",  # pool (n_pairs, 7)
            "first", "n_rows",  # rows
            "scales",  # pool (n_rows)
            "play",  # pool: misfit that rows which follow from others may keep [m]
            "axis",  # pool: axis in Q (3), normal in P (3), radius
            "function",  # address of the function of general rows
            "general",  # work: A (n_rows, n_u), b (n_rows), Adot u - bdot (n_rows)
        )
    ]
)  # fmt: skip

TASK_PROJECT, TASK_MEASURE, TASK_NEAREST, TASK_PUSH = 0, 1, 2, 3
CONSTRAINT_LOOP, CONSTRAINT_DISC, CONSTRAINT_EDGE, CONSTRAINT_GENERAL = 0, 1, 2, 3

M_C = 0  # motion of a marker, inertial components: C_NM (9),
M_R, M_V, M_O, M_A, M_E = 9, 12, 15, 18, 21  # place, velocity, rate, acceleration, angular acceleration (3 each);
M_ARM, M_COLUMNS = 24, 28  # in the body's: place from its origin (3), columns (6, row) over its coordinates

R_FP, R_TP, R_FQ, R_TQ = 0, 3, 6, 9  # a row's force and torque on the bodies at markers P and Q, body components
R_GAP, R_SPEED, R_BIAS, R_LAMBDA, R_TARGET = 12, 13, 14, 15, 16  # g, A u - b, Adot u - bdot, multiplier, right side
ROW_SIZE = 20

N_ROW, N_LEFT, N_LIMIT, N_SPEED = 0, 1, 2, 3  # of the note: row, residual and its limit; 1 for a velocity residual
N_RANK, N_LEAST, N_TIME = 4, 5, 6  # largest rank so far; its last pivot over the first where least, and when [s]
# singular configurations passed: how many, when the first ones were; time and pivot of the last two states in order
N_COUNT, N_FIRST, N_T0, N_P0, N_T1, N_P1 = 7, 8, 11, 12, 13, 14
MAX_NOTED = N_T0 - N_FIRST
NOTE_SIZE = 16

N_CLOSING, N_CONSTRAINT = (len(record.names or ()) for record in (CLOSING, CONSTRAINT))

_closing, _constraint = (record_reader(record) for record in (CLOSING, CONSTRAINT))


@inner
def closing_of(table: Table) -> np.void:
    """The CLOSING record."""
    return _closing(table, header_of(table)["closing"])


@inner
def constraint_of(table: Table, i: int) -> np.void:
    """Record i of the constraints."""
    return _constraint(table, header_of(table)["closing"] + N_CLOSING + N_CONSTRAINT * i)


def closing_record(table: Table) -> NDArray[np.void]:
    """The CLOSING record of a lowered system (1,), to read and to fill in."""
    start = int(header_record(table)["closing"])
    return table[start : start + N_CLOSING].view(CLOSING)


def constraint_records(table: Table) -> NDArray[np.void]:
    """The records of loops and nonholonomic constraints of a lowered system, to read and to fill in."""
    start = int(header_record(table)["closing"])
    n = int(closing_record(table)[0]["n_constraints"])
    return table[start + N_CLOSING : start + N_CLOSING + N_CONSTRAINT * n].view(CONSTRAINT)
