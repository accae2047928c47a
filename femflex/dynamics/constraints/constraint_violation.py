"""Remaining violation of the constraints after projection, relative to its tolerance.

Positions are brought back to rounding, velocities exactly, wherever the constraints can all be satisfied. What remains
above the limits here belongs to constraints that contradict each other, or the prescribed motions.
Rows of a loop with play that follow from others may miss by it: all rows then share what is missed, least in squares.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.constraints.multipliers import rank_of
from femflex.dynamics.constraints.row_reduction import combination
from femflex.dynamics.constraints.rows import row_of
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraint_records import closing_of, constraint_of
from femflex.dynamics.layout.records import header_of
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset

RANK_LOSS_FACTOR = 1e3  # how much larger a velocity residual may be while a row is lost in a singular configuration
RESIDUAL_TOLERANCE = 1e-10  # residual that may be left, relative to the bodies' size; of velocities also to the fastest
OPENING_RATE = 10.0  # speed at which a row with play may open, over its play times the fastest rate
PASSAGE_DIP = 0.1  # of the larger square next to it, to which a pivot's square must fall to have passed through zero
ROUNDING = 1e-14  # the same, relative to the markers' distance from the origin


@inner
def constraint_violation(t: float, u: Array, table: Table, pool: Array, work: Array) -> float:
    """Return the largest residual in units of its limit after the last correction; the NOTE says of which row."""
    closing = closing_of(table)
    size, fastest = pool[closing["tolerance"] + 1], 1.0
    for k in range(header_of(table)["n_u"]):
        fastest = max(fastest, abs(u[k]))
    note_pivot(t, table, work)
    if rank_of(table, work) < closing["n_rows"]:
        correct_speeds(table, work)
    slow = RESIDUAL_TOLERANCE * max(1.0, size) * fastest
    if rank_of(table, work) < work[closing["note"] + layout.N_RANK]:
        slow, fastest = RANK_LOSS_FACTOR * slow, RANK_LOSS_FACTOR * fastest
    worst = 0.0
    for i in range(closing["n_constraints"]):
        c = constraint_of(table, i)
        play = pool[c["play"]]
        limit = max(RESIDUAL_TOLERANCE * size, play) + ROUNDING * distance(c, work)
        for k in range(c["n_rows"]):
            row = c["first"] + k
            length = size if c["kind"] == layout.CONSTRAINT_LOOP and k >= c["n_slides"] else 1.0
            gap = abs(work[row_of(table, row) + layout.R_GAP]) * length
            worst = larger_violation(row, gap, limit, 0.0, worst, table, work)
            if rank_of(table, work) < closing["n_rows"]:
                speed = abs(work[row_of(table, row) + layout.R_SPEED])
                worst = larger_violation(
                    row, speed, max(slow, OPENING_RATE * play / length * fastest), 1.0, worst, table, work
                )
    return worst


@inner
def note_pivot(t: float, table: Table, work: Array) -> None:
    """Note how near the rows have come to losing rank: the least of the last pivot over the first."""
    closing, rank = closing_of(table), rank_of(table, work)
    note, m = closing["note"], closing["n_rows"]
    if rank > work[note + layout.N_RANK]:
        work[note + layout.N_RANK], work[note + layout.N_LEAST] = float(rank), 1.0
    index = min(int(work[note + layout.N_RANK]) - 1, rank)
    if index < 0 or work[closing["small"]] == 0.0:
        return
    ratio = work[closing["small"] + index * m + index] / work[closing["small"]]
    count_passage(t, ratio, note, work)
    if ratio < work[note + layout.N_LEAST]:
        work[note + layout.N_LEAST], work[note + layout.N_TIME] = ratio, t


@inner
def count_passage(t: float, part: float, note: int, work: Array) -> None:
    """Count a singular configuration among the last three states: the pivot's square, a parabola there, falls to zero.

    Output rows come after the step that they lie in; states that do not go on in time are left out.
    """
    t0, p0, t1, p1 = (
        work[note + layout.N_T0],
        work[note + layout.N_P0],
        work[note + layout.N_T1],
        work[note + layout.N_P1],
    )
    if p1 > 0.0 and not t > t1:
        return
    if p0 > 0.0 and p1 < p0 and p1 <= part:
        slope_before, slope_after = (p1 * p1 - p0 * p0) / (t1 - t0), (part * part - p1 * p1) / (t - t1)
        bend = (slope_after - slope_before) / (t - t0)
        slope = slope_before + bend * (t1 - t0)  # at t1
        if p1 * p1 - 0.25 * slope * slope / bend <= PASSAGE_DIP * max(p0, part) ** 2:
            count = int(work[note + layout.N_COUNT])
            if count < layout.MAX_NOTED:
                work[note + layout.N_FIRST + count] = t1 - 0.5 * slope / bend
            work[note + layout.N_COUNT] = count + 1.0
    work[note + layout.N_T0], work[note + layout.N_P0] = t1, p1
    work[note + layout.N_T1], work[note + layout.N_P1] = t, part


@inner
def correct_speeds(table: Table, work: Array) -> None:
    """Subtract the effect of the multipliers' correction of u from the rows' velocity residuals."""
    closing = closing_of(table)
    width, change = closing["width"], offset(work, closing["moved_by"])
    for j in range(width):
        change[j] = combination(j, table, work)
    for i in range(closing["n_rows"]):
        for j in range(width):
            work[row_of(table, i) + layout.R_SPEED] += work[closing["white"] + width * i + j] * change[j]


@inner
def distance(c: Record, work: Array) -> float:
    """Largest coordinate of the markers of a constraint, from the origin [m]."""
    largest = 0.0
    if c["kind"] != layout.CONSTRAINT_GENERAL:
        for k in range(3):
            P, Q = work[c["motion_P"] + layout.M_R + k], work[c["motion_Q"] + layout.M_R + k]
            largest = max(largest, abs(P), abs(Q))
    return largest


@inner
def larger_violation(
    row: int, remaining: float, limit: float, speed: float, worst: float, table: Table, work: Array
) -> float:
    """The larger of worst and left / limit; the note is that of the larger."""
    if not remaining > worst * limit:
        return worst
    note = closing_of(table)["note"]
    work[note + layout.N_ROW], work[note + layout.N_LEFT] = float(row), remaining
    work[note + layout.N_LIMIT], work[note + layout.N_SPEED] = limit, speed
    return remaining / limit
