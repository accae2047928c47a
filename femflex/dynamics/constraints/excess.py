"""What a state that was brought back still misses of its constraints, in units of what it may miss.

Positions are brought back to rounding, velocities exactly, wherever the constraints can all be satisfied. What remains
above the limits here belongs to constraints that contradict each other, or the prescribed motions.
Rows of a loop with play that follow from others may miss by it: all rows then share what is missed, least in squares.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.arithmetic.compiled import inner
from femflex.dynamics.arithmetic.lanes import beyond
from femflex.dynamics.constraints.multipliers import rank_of
from femflex.dynamics.constraints.row_reduction import combination
from femflex.dynamics.constraints.rows import row_of
from femflex.dynamics.lowering import tie_layout as at
from femflex.dynamics.lowering.layout import header_of
from femflex.dynamics.lowering.tie_layout import closing_of, constraint_of

LOOSE = 1e3  # how much larger a velocity residual may be while a row is lost in a singular configuration
HELD = 1e-10  # residual that may be left, relative to the bodies' size; of velocities also to the fastest
SWAY = 10.0  # speed at which a row with play may open, over its play times the fastest rate
DIP = 0.1  # of the larger square next to it, to which a pivot's square must fall to have passed through zero
ROUNDING = 1e-14  # the same, relative to the markers' distance from the origin


@inner
def excess(t: float, u: Array, table: Table, pool: Array, work: Array) -> float:
    """Largest residual in units of its limit, the velocities' correction just made; the NOTE says which."""
    closing = closing_of(table)
    size, fastest = pool[closing["tolerance"] + 1], 1.0
    for k in range(header_of(table)["n_u"]):
        fastest = max(fastest, abs(u[k]))
    note_pivot(t, table, work)
    if rank_of(table, work) < closing["n_rows"]:
        correct_speeds(table, work)
    slow = HELD * max(1.0, size) * fastest
    if rank_of(table, work) < work[closing["note"] + at.N_RANK]:
        slow, fastest = LOOSE * slow, LOOSE * fastest
    worst = 0.0
    for i in range(closing["n_constraints"]):
        c = constraint_of(table, i)
        play = pool[c["play"]]
        limit = max(HELD * size, play) + ROUNDING * distance(c, work)
        for k in range(c["n_rows"]):
            row = c["first"] + k
            length = size if c["kind"] == at.CONSTRAINT_LOOP and k >= c["n_slides"] else 1.0
            gap = abs(work[row_of(table, row) + at.R_GAP]) * length
            worst = noted(row, gap, limit, 0.0, worst, table, work)
            if rank_of(table, work) < closing["n_rows"]:
                speed = abs(work[row_of(table, row) + at.R_SPEED])
                worst = noted(row, speed, max(slow, SWAY * play / length * fastest), 1.0, worst, table, work)
    return worst


@inner
def note_pivot(t: float, table: Table, work: Array) -> None:
    """Note how near the rows have come to losing their rank: the least of the last pivot over the first."""
    closing, rank = closing_of(table), rank_of(table, work)
    note, m = closing["note"], closing["n_rows"]
    if rank > work[note + at.N_RANK]:
        work[note + at.N_RANK], work[note + at.N_LEAST] = float(rank), 1.0
    last = min(int(work[note + at.N_RANK]) - 1, rank)
    if last < 0 or work[closing["small"]] == 0.0:
        return
    part = work[closing["small"] + last * m + last] / work[closing["small"]]
    count_passage(t, part, note, work)
    if part < work[note + at.N_LEAST]:
        work[note + at.N_LEAST], work[note + at.N_TIME] = part, t


@inner
def count_passage(t: float, part: float, note: int, work: Array) -> None:
    """Count a singular configuration among the last three states: the pivot's square, a parabola there, falls to zero.

    Output rows come after the step that they lie in; states that do not go on in time are left out.
    """
    t0, p0, t1, p1 = work[note + at.N_T0], work[note + at.N_P0], work[note + at.N_T1], work[note + at.N_P1]
    if p1 > 0.0 and not t > t1:
        return
    if p0 > 0.0 and p1 < p0 and p1 <= part:
        left, right = (p1 * p1 - p0 * p0) / (t1 - t0), (part * part - p1 * p1) / (t - t1)
        bend = (right - left) / (t - t0)
        slope = left + bend * (t1 - t0)  # at t1
        if p1 * p1 - 0.25 * slope * slope / bend <= DIP * max(p0, part) ** 2:
            count = int(work[note + at.N_COUNT])
            if count < at.NOTED:
                work[note + at.N_FIRST + count] = t1 - 0.5 * slope / bend
            work[note + at.N_COUNT] = count + 1.0
    work[note + at.N_T0], work[note + at.N_P0] = t1, p1
    work[note + at.N_T1], work[note + at.N_P1] = t, part


@inner
def correct_speeds(table: Table, work: Array) -> None:
    """Take from the rows' velocity residuals what the multipliers' correction of u takes away."""
    closing = closing_of(table)
    width, moved = closing["width"], beyond(work, closing["moved_by"])
    for j in range(width):
        moved[j] = combination(j, table, work)
    for i in range(closing["n_rows"]):
        for j in range(width):
            work[row_of(table, i) + at.R_SPEED] += work[closing["white"] + width * i + j] * moved[j]


@inner
def distance(c: Record, work: Array) -> float:
    """Largest coordinate of the markers of a constraint, from the origin [m]."""
    largest = 0.0
    if c["kind"] != at.CONSTRAINT_GENERAL:
        for k in range(3):
            P, Q = work[c["motion_P"] + at.M_R + k], work[c["motion_Q"] + at.M_R + k]
            largest = max(largest, abs(P), abs(Q))
    return largest


@inner
def noted(row: int, left: float, limit: float, speed: float, worst: float, table: Table, work: Array) -> float:
    """The larger of worst and left / limit; the note is that of the larger."""
    if not left > worst * limit:
        return worst
    note = closing_of(table)["note"]
    work[note + at.N_ROW], work[note + at.N_LEFT] = float(row), left
    work[note + at.N_LIMIT], work[note + at.N_SPEED] = limit, speed
    return left / limit
