"""Compiled parts shared by the implicit methods: output by cubic Hermite polynomials, Newton's verdict, step sizes.

The vectors kept between calls begin with the four rows x, dx/dt at the end of the last step and at its beginning.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.integrate import resume as head
from femflex.integrate.compiled import part
from femflex.integrate.holding import Hold
from femflex.integrate.protocol import Call, Own
from femflex.integrate.vectors import accept, clipped, first_not_finite, normalise, put

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Span = tuple[float, float, float]

X, XDOT, X_OLD, XDOT_OLD = 0, 1, 2, 3
KAPPA = 0.01  # Newton's error at the end of an iteration, in units of the tolerance
MAX_ITERATIONS, SLOWEST = 10, 0.8  # an iteration that contracts less is given up
SAFETY = 0.9
DOUBT = 0.5  # contraction assumed where none is known


@part
def interpolate(theta: float, h: float, vectors: Array, row: Array) -> None:
    """Set row to the state at the fraction theta of the last step of size h, by values and rates at both ends."""
    rest = 1.0 - theta
    for i in range(row.size):
        x0, x1 = vectors[X_OLD, i], vectors[X, i]
        v0, v1 = h * vectors[XDOT_OLD, i] - (x1 - x0), h * vectors[XDOT, i] - (x1 - x0)
        row[i] = rest * x0 + theta * x1 + theta * rest * (rest * v0 - theta * v1)


@part
def hand_out(
    times: Array, rows: Array, row: int, state: Array, vectors: Array, renormalise: IntArray, hold: Hold, own: Own
) -> int:
    """Number of rows written in all, after those whose times the steps have reached."""
    t, t_old = state[head.T], state[head.T_OLD]
    while row < rows.shape[0] and times[row] <= t:
        if times[row] == t:
            put(vectors[X], rows[row])
        else:
            interpolate((times[row] - t_old) / (t - t_old), t - t_old, vectors, rows[row])
            normalise(rows[row], renormalise)
            if hold[0]:
                hold[1](times[row], rows[row], *own)
        state[head.LAST_OUT] = times[row]
        row += 1
    return row


@part
def scaled_norm(e: Array, x: Array, y: Array, rtol: float, atol: Array) -> float:
    """Root mean square of e in units of the tolerance at x and y."""
    total = 0.0
    for i in range(e.size):
        total += (e[i] / (atol[i] + rtol * max(abs(x[i]), abs(y[i])))) ** 2
    return float(math.sqrt(total / e.size))


@part
def contraction(iteration: int, change: float, before: float, memory: float) -> float:
    """Ratio of the last two Newton corrections; before there are two, that of the step before, worsened.

    The memory is not trusted below 1e-3: a correction of many tolerances always asks for a second one.
    """
    if iteration == 0:
        return max(memory, 1e-3) ** 0.8
    return change / before if before > 0.0 else 0.0


@part
def converged(theta: float, change: float) -> bool:
    """Whether what Newton's method still has to correct is below KAPPA, from its contraction theta < 1."""
    return theta < 1.0 and theta / (1.0 - theta) * change <= KAPPA


@part
def reject(cause: int, h_new: float, e: Array, x: Array, bad: Array, rtol: float, atol: Array, state: Array) -> None:
    """Shorten the step after a failed trial and note why: an entry of `bad` not finite, or the largest error in e."""
    state[head.REJECTED] += 1
    state[head.REJECTED_LAST] = 1.0
    state[head.H] = h_new
    state[head.CONTRACTION] = DOUBT
    index = first_not_finite(bad)
    state[head.CAUSE] = head.NOT_FINITE if index >= 0 else cause
    largest = -1.0
    for i in range(e.size if index < 0 else 0):
        scaled = abs(e[i]) / (atol[i] + rtol * abs(x[i]))
        if scaled > largest:
            largest, index = scaled, i
    state[head.COORDINATE] = max(index, 0)


@part
def renew_coordinates(
    switch: Call, kinematic: Call, own: Own, span: Span, n_q: int, state: Array, vectors: Array
) -> None:
    """Change coordinates that are about to fail, once every row of the last step is handed out."""
    x = vectors[X]
    t = clipped(state[head.T], span[1], span[2])
    if switch(t, x, *own) > 0:
        kinematic(t, x[:n_q], x[n_q:], vectors[XDOT][:n_q], *own)
        state[head.DENSE] = 0.0  # the polynomial of the last step holds no longer


@part
def shorter(error: float, order: int, shrink: float) -> float:
    """Factor on a step that failed, below 1: for an error of h^order, or where the rate at its end is not finite."""
    return float(max(shrink, SAFETY * error ** (-1 / order))) if 1.0 < error < math.inf else shrink


@part
def step_accepted(
    t_new: float,
    h: float,
    wanted: float,
    fixed: float,
    error: float,
    order: int,
    shrink: float,
    grow: float,
    state: Array,
) -> None:
    """Note an accepted step, and the next step by a controller with memory; a fixed one is kept."""
    factor = SAFETY * error ** (-0.7 / order) * state[head.ERROR] ** (0.4 / order) if error > 0.0 else grow
    accept(t_new, h, wanted, min(grow, max(shrink, factor)), error, True, state)
    if fixed > 0.0:
        state[head.H] = min(fixed, 2.0 * h)  # back to it by doubling after a failure
