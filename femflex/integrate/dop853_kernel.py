"""Compiled steps of the order-8 Dormand-Prince method: trial step, error, interpolant, and the loop over them.

Notation of Hairer, Norsett & Wanner (1993) II.4 and II.10: stages k (16, n), step h from (t, x) to y. The vectors kept
between calls are (10, n): x, k1 = f(t, x), and the interpolant of the last step (x_old, F0, ..., F6). `arrays` is the
model's (table, pool, work). `span` is (end, lo, hi): the end of the interval, and the limits of the times at which the
rate may be evaluated.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, IntArray
from femflex.integrate import resume as head
from femflex.integrate.compiled import ENDED, INDICES, INTEGER, REAL, SPAN, TABLE, VECTOR, kernel, part, summing, types
from femflex.integrate.dop853_table import A, C, D, E
from femflex.integrate.protocol import MODEL_ARRAYS, RATE, SWITCH, Call, ModelArrays
from femflex.integrate.step_control import (
    FILTERED,
    accept,
    filtered,
    reduction_factor,
    reject,
    reject_infeasible,
    shortened_step,
    step_status,
)
from femflex.integrate.vectors import (
    PROJECTION,
    Projection,
    clipped,
    copy_vector,
    first_not_finite,
    normalise,
    write_rows,
)

Span = tuple[float, float, float]

X, K1, X_OLD, F0 = 0, 1, 2, 3  # rows of the kept vectors
Y, E3, E5 = 0, 1, 2  # rows of the scratch vectors: end of the trial step, its two errors
N_SCRATCH, N_STAGES = 3, 16

SHRINK, GROW = 1 / 3, 6.0  # limits of h_new / h
RETREAT = 0.2  # h_new / h after a value that is not finite


@part
def add(y: Array, h: float, weights: Array, k: Array) -> None:
    """Add h * sum_j weights[j] k[j] to y."""
    for j in range(weights.size):
        weight = h * weights[j]
        if weight != 0.0:
            for i in range(y.size):
                y[i] += weight * k[j, i]


@part
def stages(
    rate: Call, arrays: ModelArrays, span: Span, which: range, t: float, h: float, x: Array, k: Array, y: Array
) -> None:
    """Set the stages k[s] for s in `which`, each from those before it; y is scratch."""
    for s in which:
        copy_vector(x, y)
        add(y, h, A[s, :s], k)
        rate(clipped(t + C[s] * h, span[1], span[2]), y, k[s], *arrays)


@summing
def scaled_error(h: float, x: Array, scratch: Array, rtol: float, atol: Array) -> float:
    """Error of the step in units of the tolerance, orders 5 and 3 blended (II.10)."""
    sum3, sum5, count = 0.0, 0.0, 0
    for i in range(x.size):
        scale = 1.0 / (atol[i] + rtol * max(abs(x[i]), abs(scratch[Y, i])))
        sum3 += (scratch[E3, i] * scale) ** 2
        sum5 += (scratch[E5, i] * scale) ** 2
        count += scale > 0.0
    if sum5 == 0.0 and sum3 == 0.0:
        return 0.0
    return h * sum5 / math.sqrt((sum5 + 0.01 * sum3) * count)


@part
def trial(
    rate: Call,
    arrays: ModelArrays,
    span: Span,
    t: float,
    h: float,
    x: Array,
    k: Array,
    scratch: Array,
    rtol: float,
    atol: Array,
) -> float:
    """Scaled error of a step of size h from k[0] = f(t, x); its end is left in scratch[Y]."""
    stages(rate, arrays, span, range(1, 12), t, h, x, k, scratch[Y])
    copy_vector(x, scratch[Y])
    add(scratch[Y], h, A[12, :12], k)
    for i in range(x.size):
        scratch[E3, i] = scratch[E5, i] = 0.0
    add(scratch[E3], 1.0, E[3], k)
    add(scratch[E5], 1.0, E[5], k)
    return scaled_error(h, x, scratch, rtol, atol)


@part
def shorten_step(
    h: float, error: float, n_k: int, x: Array, k: Array, scratch: Array, rtol: float, atol: Array, state: Array
) -> None:
    """Shorten the step after a failed trial: by its error, or at once where a stage or its end is not finite."""
    index = -1
    for s in range(n_k + 1):  # the step's end comes last: there a bad value has spread
        if index < 0:
            index = first_not_finite(k[s] if s < n_k else scratch[Y])
    factor = reduction_factor(error, 8, FILTERED, SHRINK, RETREAT) if index < 0 else RETREAT
    reject(head.ERROR_TEST, h * factor, index, scratch[E5], x, rtol, atol, state)


@part
def set_interpolant(h: float, k: Array, vectors: Array) -> None:
    """Set F0 ... F6 of the dense output of order 7 from all sixteen stages (II.10)."""
    F = vectors[F0:]
    for i in range(k.shape[1]):
        difference = vectors[X, i] - vectors[X_OLD, i]
        F[0, i] = difference
        F[1, i] = h * k[0, i] - difference
        F[2, i] = 2.0 * difference - h * (k[12, i] + k[0, i])
        F[3, i] = F[4, i] = F[5, i] = F[6, i] = 0.0
    for row in range(4):
        add(F[3 + row], h, D[row], k)


@part
def interpolate(theta: float, h: float, vectors: Array, row: Array) -> None:
    """Set row to the state at the fraction theta of the last step (nested as in the program DOP853)."""
    rest = 1.0 - theta
    F = vectors[F0:]
    for i in range(row.size):
        inner = F[3, i] + theta * (F[4, i] + rest * (F[5, i] + theta * F[6, i]))
        row[i] = vectors[X_OLD, i] + theta * (F[0, i] + rest * (F[1, i] + theta * (F[2, i] + rest * inner)))


_TOLERANCES = types.Tuple((REAL, VECTOR, REAL))
_STORAGE = types.Tuple((VECTOR, TABLE, TABLE, TABLE))
_CALLS = types.Tuple((PROJECTION, types.FunctionType(RATE), types.FunctionType(SWITCH)))  # Numba warns of a call first
_SIGNATURE = ENDED(_CALLS, MODEL_ARRAYS, SPAN, INDICES, _TOLERANCES, _STORAGE, VECTOR, TABLE, INTEGER)


@kernel(_SIGNATURE)
def fill(
    calls: tuple[Projection, Call, Call],
    arrays: ModelArrays,
    span: Span,
    renormalise: IntArray,
    tolerances: tuple[float, Array, float],
    storage: tuple[Array, Array, Array, Array],
    times: Array,
    rows: Array,
    budget: int,
) -> tuple[int, int]:
    """Take at most `budget` trial steps; return the status (FULL, END, PAUSE, STUCK) and the number of rows written.

    `times` starts with the first output time that is not written yet and continues beyond the last requested row.
    tolerances: relative, absolute and the longest step; storage: resume state, kept vectors, stages and scratch
    """
    projection, rate, switch = calls
    rtol, atol, max_step = tolerances
    state, vectors, k, scratch = storage
    row = 0
    x, y = vectors[X], scratch[Y]
    while True:
        row = write_rows(interpolate, times, rows, row, state, vectors, renormalise, projection, arrays)
        t, h_planned = state[head.T], min(state[head.H], max_step)
        status = step_status(row, rows.shape[0], h_planned, span[0], budget, state)
        if status != head.CONTINUE:
            return status, row
        budget -= 1

        if switch(state[head.T], x, *arrays) > 0:  # every row of the last step is written
            rate(clipped(t, span[1], span[2]), x, vectors[K1], *arrays)
            state[head.EVALUATIONS] += 1
        h = shortened_step(t, h_planned, span[0])
        copy_vector(vectors[K1], k[0])
        error = trial(rate, arrays, span, t, h, x, k, scratch, rtol, atol)
        state[head.EVALUATIONS] += 11
        if not error <= 1.0:
            shorten_step(h, error, 12, x, k, scratch, rtol, atol, state)
            continue
        normalise(y, renormalise)
        t_new = span[0] if h == span[0] - t else t + h
        if projection[0] and projection[1](t_new, y, *arrays) > 1.0:
            reject_infeasible(h * RETREAT, state)
            continue
        rate(clipped(t_new, span[1], span[2]), y, k[12], *arrays)
        state[head.EVALUATIONS] += 1
        if first_not_finite(k[12]) >= 0 or first_not_finite(y) >= 0:
            shorten_step(h, error, 13, x, k, scratch, rtol, atol, state)
            continue

        dense = times[row] < t_new
        copy_vector(x, vectors[X_OLD])
        if dense:
            stages(rate, arrays, span, range(13, 16), t, h, vectors[X_OLD], k, scratch[E3])
            state[head.EVALUATIONS] += 3
        copy_vector(y, x)
        copy_vector(k[12], vectors[K1])
        if dense:
            set_interpolant(h, k, vectors)
        accept(t_new, h, h_planned, filtered(h, error, 8, SHRINK, GROW, state), error, dense, state)
