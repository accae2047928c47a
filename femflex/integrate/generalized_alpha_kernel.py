"""Compiled steps of the generalised-alpha method: Newton's iteration, error, and the loop over steps.

Notation of Arnold & Bruels (2007), with v = (u, z) for the states of first order and w = dv/dt. States z are integrated
by the method's formulas of velocities, which have order 2 and numerical damping for them too. The vectors kept between
calls are (6, n_x): x = (q, v), dx/dt, both at the beginning of the last step, and two slopes of w, each (n_v,):
`g` = (a - w) / h, which carries the method's own acceleration a over a change of step, and `s`, the mean slope over the
last step.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, IntArray
from femflex.integrate import resume as head
from femflex.integrate.compiled import ENDED, INDICES, INTEGER, REAL, SPAN, TABLE, VECTOR, kernel, part, shared, types
from femflex.integrate.hermite import (
    KAPPA,
    MAX_ITERATIONS,
    SLOWEST,
    X_OLD,
    XDOT,
    XDOT_OLD,
    X,
    contraction,
    converged,
    newton_failed,
    projected_end,
    renew_coordinates,
    tested_error,
    write_rows,
)
from femflex.integrate.projection import PROJECTION, Projection
from femflex.integrate.protocol import ADVANCE, CORRECT, KINEMATIC, MODEL_ARRAYS, RATE, SWITCH, Call, ModelArrays
from femflex.integrate.step_control import scaled_norm, shortened_step, step_accepted, step_status
from femflex.integrate.vectors import clipped, copy_vector, normalise

Span = tuple[float, float, float]

SLOPES, MEAN_SLOPES = 4, 5  # rows of the kept vectors, in addition to the four of `hermite`
# rows of the scratch vectors: end of the trial step, its rate, error, a correction in x; the rest are (n_v,)
Y, YDOT, E, CHANGE, INCREMENT, A_NEW, DELTA, VELOCITY = 0, 1, 2, 3, 4, 5, 6, 7
N_SCRATCH = 8
SHRINK, GROW = 0.3, 3.0


@shared
def parameters(rho: float) -> tuple[float, float, float, float]:
    """alpha_m, alpha_f, beta, gamma for the spectral radius rho at infinite frequency (Chung & Hulbert 1993)."""
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    return alpha_m, alpha_f, 0.25 * (1.0 - alpha_m + alpha_f) ** 2, 0.5 - alpha_m + alpha_f


@shared
def error_constants(rho: float) -> tuple[float, float]:
    """Leading errors of a step, C_q h^3 u'' in q and C_u h^3 u''' in u, by Taylor series; a leads w by d h."""
    alpha_m, alpha_f, beta, gamma = parameters(rho)
    d = alpha_m - alpha_f
    lag = 0.5 * ((1.0 - alpha_f) - (1.0 - alpha_m) * (1.0 + d) ** 2 - alpha_m * d**2)
    return 0.5 * d + beta - 1 / 6, 0.5 * ((1.0 - gamma) * d**2 + gamma * (1.0 + d) ** 2) + lag - 1 / 6


@part
def update(advance: Call, arrays: ModelArrays, h: float, rho: float, n_q: int, vectors: Array, scratch: Array) -> None:
    """Set the end of the step (q, v) and a from its w, scratch[YDOT]."""
    alpha_m, alpha_f, beta, gamma = parameters(rho)
    for i in range(vectors.shape[1] - n_q):
        u, w, w_new = vectors[X, n_q + i], vectors[XDOT, n_q + i], scratch[YDOT, n_q + i]
        a = w + h * vectors[SLOPES, i]
        a_new = ((1.0 - alpha_f) * w_new + alpha_f * w - alpha_m * a) / (1.0 - alpha_m)
        scratch[A_NEW, i] = a_new
        scratch[INCREMENT, i] = h * u + h**2 * ((0.5 - beta) * a + beta * a_new)
        scratch[Y, n_q + i] = u + h * ((1.0 - gamma) * a + gamma * a_new)
    n_v = vectors.shape[1] - n_q
    advance(vectors[X][:n_q], scratch[INCREMENT][:n_v], scratch[Y][:n_q], *arrays)


@part
def newton(
    correct: Call,
    kinematic: Call,
    advance: Call,
    arrays: ModelArrays,
    t: float,
    h: float,
    rho: float,
    n_q: int,
    rtol: float,
    atol: Array,
    state: Array,
    vectors: Array,
    scratch: Array,
) -> bool:
    """Whether Newton's method found the end of the step; its matrix is S = M + gamma' h D + beta' h^2 K."""
    alpha_m, alpha_f, beta, gamma = parameters(rho)
    ratio = (1.0 - alpha_f) / (1.0 - alpha_m)
    c_damp, c_stiff = gamma * ratio * h, beta * ratio * h**2
    n_v = vectors.shape[1] - n_q
    q, u, w = scratch[Y][:n_q], scratch[Y][n_q:], scratch[YDOT][n_q:]
    delta, velocity = scratch[DELTA][:n_v], scratch[VELOCITY][:n_v]
    for i in range(n_v):
        w[i] = vectors[XDOT, n_q + i] + h * vectors[MEAN_SLOPES, i]
    update(advance, arrays, h, rho, n_q, vectors, scratch)
    before = 0.0
    for iteration in range(MAX_ITERATIONS):
        correct(t, q, u, w, delta, c_damp, c_stiff, *arrays)
        state[head.EVALUATIONS] += 1
        for i in range(n_v):
            w[i] += delta[i]
            velocity[i] = c_stiff * delta[i]
            scratch[CHANGE, n_q + i] = c_damp * delta[i]
        kinematic(t, q, velocity, scratch[CHANGE][:n_q], *arrays)
        change = scaled_norm(scratch[CHANGE], vectors[X], scratch[Y], rtol, atol)
        theta = contraction(iteration, change, before, state[head.CONTRACTION])
        update(advance, arrays, h, rho, n_q, vectors, scratch)
        if not math.isfinite(change) or (iteration > 0 and theta > SLOWEST and change > KAPPA):
            return False
        state[head.CONTRACTION] = min(theta, SLOWEST)
        if converged(theta, change):
            return True
        before = change
    return False


@part
def set_error(
    kinematic: Call,
    arrays: ModelArrays,
    t: float,
    h: float,
    rho: float,
    n_q: int,
    state: Array,
    vectors: Array,
    scratch: Array,
) -> None:
    """Set the error of the step, scratch[E], from the changes of a over the step and of the slope of w."""
    C_q, C_u = error_constants(rho)
    n_v = vectors.shape[1] - n_q
    velocity = scratch[VELOCITY][:n_v]
    between = 0.5 * (h + state[head.T] - state[head.T_OLD])  # of the middles of the last two steps
    for i in range(n_v):
        w = vectors[XDOT, n_q + i]
        velocity[i] = C_q * h**2 * (scratch[A_NEW, i] - w - h * vectors[SLOPES, i])
        slope = (scratch[YDOT, n_q + i] - w) / h
        scratch[E, n_q + i] = C_u * h**3 * (slope - vectors[MEAN_SLOPES, i]) / between
    kinematic(t, scratch[Y][:n_q], velocity, scratch[E][:n_q], *arrays)


@part
def store_step_end(h: float, n_q: int, vectors: Array, scratch: Array) -> None:
    """Make the end of the accepted step the state."""
    copy_vector(vectors[X], vectors[X_OLD])
    copy_vector(vectors[XDOT], vectors[XDOT_OLD])
    copy_vector(scratch[Y], vectors[X])
    copy_vector(scratch[YDOT], vectors[XDOT])
    n_v = vectors.shape[1] - n_q
    for i in range(n_v):
        vectors[SLOPES, i] = (scratch[A_NEW, i] - scratch[YDOT, n_q + i]) / h
        vectors[MEAN_SLOPES, i] = (scratch[YDOT, n_q + i] - vectors[XDOT_OLD, n_q + i]) / h


_CALLS = (*(types.FunctionType(call) for call in (RATE, CORRECT, KINEMATIC, ADVANCE, SWITCH)), PROJECTION)
_SETTINGS = (REAL, REAL, REAL, VECTOR, REAL)  # rho, fixed, rtol, atol, max_step
_STORAGE = (VECTOR, TABLE, TABLE)  # state, vectors, scratch
_SIGNATURE = ENDED(*_CALLS, MODEL_ARRAYS, SPAN, INDICES, INTEGER, *_SETTINGS, *_STORAGE, *(VECTOR, TABLE), INTEGER)


@kernel(_SIGNATURE)
def fill(
    rate: Call,
    correct: Call,
    kinematic: Call,
    advance: Call,
    switch: Call,
    projection: Projection,
    arrays: ModelArrays,
    span: Span,
    renormalise: IntArray,
    n_q: int,
    rho: float,
    fixed: float,
    rtol: float,
    atol: Array,
    max_step: float,
    state: Array,
    vectors: Array,
    scratch: Array,
    times: Array,
    rows: Array,
    budget: int,
) -> tuple[int, int]:
    """Take at most `budget` trial steps; return the status (FULL, END, PAUSE, STUCK) and the number of rows written.

    With fixed > 0 every step that converges is accepted and has that size.
    """
    row = 0
    x, y = vectors[X], scratch[Y]
    while True:
        row = write_rows(times, rows, row, state, vectors, renormalise, projection, arrays)
        t, h_planned = state[head.T], min(state[head.H], max_step)
        status = step_status(row, rows.shape[0], h_planned, span[0], budget, state)
        if status != head.CONTINUE:
            return status, row
        budget -= 1

        renew_coordinates(switch, kinematic, arrays, span, n_q, state, vectors)
        h = shortened_step(t, h_planned, span[0])
        t_new = span[0] if h == span[0] - t else t + h
        t_inside = clipped(t_new, span[1], span[2])
        if not newton(correct, kinematic, advance, arrays, t_inside, h, rho, n_q, rtol, atol, state, vectors, scratch):
            newton_failed(0.5 * h, scratch[CHANGE], x, rtol, atol, state)
            continue
        normalise(y, renormalise)
        if not projected_end(rate, kinematic, projection, arrays, t_inside, h * SHRINK, n_q, y, scratch[YDOT], state):
            continue
        set_error(kinematic, arrays, t_inside, h, rho, n_q, state, vectors, scratch)
        error = tested_error(h, 3, SHRINK, fixed, scratch[E], x, y, scratch[YDOT], rtol, atol, state)
        if error < 0.0:
            continue
        store_step_end(h, n_q, vectors, scratch)
        step_accepted(t_new, h, h_planned, fixed, error, 3, SHRINK, GROW, state)
