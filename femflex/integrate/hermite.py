"""Compiled parts shared by the implicit methods: output by cubic Hermite polynomials, convergence of Newton's method,
and the error test of a step.

The vectors kept between calls begin with the four rows x, dx/dt at the end of the last step and at its beginning.
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.integrate import resume as head
from femflex.integrate.compiled import part
from femflex.integrate.protocol import Call, ModelArrays
from femflex.integrate.step_control import SAFETY, reduction_factor, reject, reject_infeasible, scaled_norm
from femflex.integrate.vectors import Projection, clipped, first_not_finite

Span = tuple[float, float, float]

X, XDOT, X_OLD, XDOT_OLD = 0, 1, 2, 3
KAPPA = 0.01  # Newton's error at the end of an iteration, in units of the tolerance
MAX_ITERATIONS, SLOWEST = 10, 0.8  # an iteration that contracts less is given up
DEFAULT_CONTRACTION = 0.5  # contraction assumed where none is known


@part
def interpolate(theta: float, h: float, vectors: Array, row: Array) -> None:
    """Set row to the state at the fraction theta of the last step of size h, by values and rates at both ends."""
    rest = 1.0 - theta
    for i in range(row.size):
        x0, x1 = vectors[X_OLD, i], vectors[X, i]
        v0, v1 = h * vectors[XDOT_OLD, i] - (x1 - x0), h * vectors[XDOT, i] - (x1 - x0)
        row[i] = rest * x0 + theta * x1 + theta * rest * (rest * v0 - theta * v1)


@part
def contraction(iteration: int, change: float, before: float, memory: float) -> float:
    """Ratio of the last two Newton corrections; before there are two, that of the step before, worsened.

    The memory counts as at least 1e-3: after a correction of many tolerances a second one always follows.
    """
    if iteration == 0:
        return max(memory, 1e-3) ** 0.8
    return change / before if before > 0.0 else 0.0


@part
def converged(theta: float, change: float) -> bool:
    """Whether the remaining error of Newton's method is below KAPPA, estimated from its contraction theta < 1."""
    return theta < 1.0 and theta / (1.0 - theta) * change <= KAPPA


@part
def renew_coordinates(
    switch: Call, kinematic: Call, arrays: ModelArrays, span: Span, n_q: int, state: Array, vectors: Array
) -> None:
    """Switch coordinates close to a singularity, once every row of the last step is written."""
    x = vectors[X]
    t = clipped(state[head.T], span[1], span[2])
    if switch(t, x, *arrays) > 0:
        kinematic(t, x[:n_q], x[n_q:], vectors[XDOT][:n_q], *arrays)
        state[head.DENSE] = 0.0  # the polynomial of the last step is no longer valid


@part
def newton_failed(h_new: float, change: Array, x: Array, rtol: float, atol: Array, state: Array) -> None:
    """Shorten the step after Newton's method has failed, by its last correction."""
    state[head.CONTRACTION] = DEFAULT_CONTRACTION
    reject(head.NEWTON, h_new, first_not_finite(change), change, x, rtol, atol, state)


@part
def projected_end(
    rate: Call,
    kinematic: Call,
    projection: Projection,
    arrays: ModelArrays,
    t: float,
    h_shorter: float,
    n_q: int,
    y: Array,
    ydot: Array,
    state: Array,
) -> bool:
    """Project the end y of a trial step onto the constraints and set its rate; False if it violates them still."""
    if not projection[0]:
        kinematic(t, y[:n_q], y[n_q:], ydot[:n_q], *arrays)
        return True
    if projection[1](t, y, *arrays) > 1.0:
        reject_infeasible(h_shorter, state)
        return False
    rate(t, y, ydot, *arrays)
    return True


@part
def tested_error(
    h: float,
    order: int,
    shrink: float,
    fixed: float,
    e: Array,
    x: Array,
    y: Array,
    ydot: Array,
    tolerances: tuple[float, Array],
    state: Array,
) -> float:
    """Error of a trial step in units of the tolerance, 0 where steps are fixed; -1 where the step is rejected."""
    rtol, atol = tolerances
    error = scaled_norm(e, x, y, rtol, atol)
    if fixed > 0.0 and math.isfinite(error):
        error = 0.0
    if error <= 1.0 and first_not_finite(ydot) < 0:
        return error
    state[head.CONTRACTION] = DEFAULT_CONTRACTION
    h_new = h * reduction_factor(error, order, SAFETY, shrink, shrink)
    reject(head.ERROR_TEST, h_new, first_not_finite(ydot), e, x, rtol, atol, state)
    return -1.0
