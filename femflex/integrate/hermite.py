"""Compiled parts shared by the implicit methods: output by cubic Hermite polynomials, Newton's verdict,
and the judgement of a step.

The vectors kept between calls begin with the four rows x, dx/dt at the end of the last step and at its beginning.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, IntArray
from femflex.integrate import resume as head
from femflex.integrate.compiled import part
from femflex.integrate.holding import Hold
from femflex.integrate.protocol import Call, Own
from femflex.integrate.step_control import SAFETY, reject, retreat, scaled_norm, shorter
from femflex.integrate.vectors import clipped, first_not_finite, normalise, put

Span = tuple[float, float, float]

X, XDOT, X_OLD, XDOT_OLD = 0, 1, 2, 3
KAPPA = 0.01  # Newton's error at the end of an iteration, in units of the tolerance
MAX_ITERATIONS, SLOWEST = 10, 0.8  # an iteration that contracts less is given up
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
def newton_failed(h_new: float, change: Array, x: Array, rtol: float, atol: Array, state: Array) -> None:
    """Shorten the step after Newton's method has failed, by its last correction."""
    state[head.CONTRACTION] = DOUBT
    reject(head.NEWTON, h_new, first_not_finite(change), change, x, rtol, atol, state)


@part
def held_end(
    rate: Call,
    kinematic: Call,
    hold: Hold,
    own: Own,
    t: float,
    h_less: float,
    n_q: int,
    y: Array,
    ydot: Array,
    state: Array,
) -> bool:
    """Whether the end y of a trial step, brought onto the constraints, satisfies them; its rate is set."""
    if not hold[0]:
        kinematic(t, y[:n_q], y[n_q:], ydot[:n_q], *own)
        return True
    if hold[1](t, y, *own) > 1.0:
        retreat(h_less, state)
        return False
    rate(t, y, ydot, *own)
    return True


@part
def judged(
    h: float,
    order: int,
    shrink: float,
    fixed: float,
    e: Array,
    x: Array,
    y: Array,
    ydot: Array,
    rtol: float,
    atol: Array,
    state: Array,
) -> float:
    """Error of a trial step in units of the tolerance, 0 where steps are fixed; -1 where the step is rejected."""
    error = scaled_norm(e, x, y, rtol, atol)
    if fixed > 0.0 and math.isfinite(error):
        error = 0.0
    if error <= 1.0 and first_not_finite(ydot) < 0:
        return error
    state[head.CONTRACTION] = DOUBT
    h_new = h * shorter(error, order, SAFETY, shrink, shrink)
    reject(head.ERROR_TEST, h_new, first_not_finite(ydot), e, x, rtol, atol, state)
    return -1.0
