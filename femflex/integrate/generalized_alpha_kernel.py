"""Compiled steps of the generalised-alpha method: Newton's iteration, error, and the loop over steps.

Notation of Arnold & Bruels (2007), with v = (u, z) for what has a rate of its own and w = dv/dt: states z go by the
method's formulas of velocities, which are of order 2 for them too and damp fast ones likewise. The vectors kept between
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
    hand_out,
    held_end,
    judged,
    newton_failed,
    renew_coordinates,
)
from femflex.integrate.holding import HOLD, Hold
from femflex.integrate.protocol import ADVANCE, CORRECT, KINEMATIC, OWN, RATE, SWITCH, Call, Own
from femflex.integrate.step_control import cut, scaled_norm, standing, step_accepted
from femflex.integrate.vectors import clipped, normalise, put

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
def update(advance: Call, own: Own, h: float, rho: float, n_q: int, vectors: Array, scratch: Array) -> None:
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
    advance(vectors[X][:n_q], scratch[INCREMENT][:n_v], scratch[Y][:n_q], *own)


@part
def newton(
    correct: Call,
    kinematic: Call,
    advance: Call,
    own: Own,
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
    """Whether Newton's method found the end of the step; S = M + gamma' h D + beta' h^2 K stands for its matrix."""
    alpha_m, alpha_f, beta, gamma = parameters(rho)
    ratio = (1.0 - alpha_f) / (1.0 - alpha_m)
    c_damp, c_stiff = gamma * ratio * h, beta * ratio * h**2
    n_v = vectors.shape[1] - n_q
    q, u, w = scratch[Y][:n_q], scratch[Y][n_q:], scratch[YDOT][n_q:]
    delta, velocity = scratch[DELTA][:n_v], scratch[VELOCITY][:n_v]
    for i in range(n_v):
        w[i] = vectors[XDOT, n_q + i] + h * vectors[MEAN_SLOPES, i]
    update(advance, own, h, rho, n_q, vectors, scratch)
    before = 0.0
    for iteration in range(MAX_ITERATIONS):
        correct(t, q, u, w, delta, c_damp, c_stiff, *own)
        state[head.EVALUATIONS] += 1
        for i in range(n_v):
            w[i] += delta[i]
            velocity[i] = c_stiff * delta[i]
            scratch[CHANGE, n_q + i] = c_damp * delta[i]
        kinematic(t, q, velocity, scratch[CHANGE][:n_q], *own)
        change = scaled_norm(scratch[CHANGE], vectors[X], scratch[Y], rtol, atol)
        theta = contraction(iteration, change, before, state[head.CONTRACTION])
        update(advance, own, h, rho, n_q, vectors, scratch)
        if not math.isfinite(change) or (iteration > 0 and theta > SLOWEST and change > KAPPA):
            return False
        state[head.CONTRACTION] = min(theta, SLOWEST)
        if converged(theta, change):
            return True
        before = change
    return False


@part
def set_error(
    kinematic: Call, own: Own, t: float, h: float, rho: float, n_q: int, state: Array, vectors: Array, scratch: Array
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
    kinematic(t, scratch[Y][:n_q], velocity, scratch[E][:n_q], *own)


@part
def move_on(h: float, n_q: int, vectors: Array, scratch: Array) -> None:
    """Make the end of the accepted step the state."""
    put(vectors[X], vectors[X_OLD])
    put(vectors[XDOT], vectors[XDOT_OLD])
    put(scratch[Y], vectors[X])
    put(scratch[YDOT], vectors[XDOT])
    n_v = vectors.shape[1] - n_q
    for i in range(n_v):
        vectors[SLOPES, i] = (scratch[A_NEW, i] - scratch[YDOT, n_q + i]) / h
        vectors[MEAN_SLOPES, i] = (scratch[YDOT, n_q + i] - vectors[XDOT_OLD, n_q + i]) / h


_CALLS = (*(types.FunctionType(call) for call in (RATE, CORRECT, KINEMATIC, ADVANCE, SWITCH)), HOLD)
_SETTINGS = (REAL, REAL, REAL, VECTOR, REAL)  # rho, fixed, rtol, atol, max_step
_KEPT = (VECTOR, TABLE, TABLE)  # state, vectors, scratch
_SIGNATURE = ENDED(*_CALLS, OWN, SPAN, INDICES, INTEGER, *_SETTINGS, *_KEPT, *(VECTOR, TABLE), INTEGER)


@kernel(_SIGNATURE)
def fill(
    rate: Call,
    correct: Call,
    kinematic: Call,
    advance: Call,
    switch: Call,
    hold: Hold,
    own: Own,
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
    """How the call ended (FULL, END, PAUSE, STUCK) and the number of rows written, after at most `budget` trials.

    With fixed > 0 every step that converges is accepted and has that size.
    """
    row = 0
    x, y = vectors[X], scratch[Y]
    while True:
        row = hand_out(times, rows, row, state, vectors, renormalise, hold, own)
        t, wanted = state[head.T], min(state[head.H], max_step)
        status = standing(row, rows.shape[0], wanted, span[0], budget, state)
        if status != head.GO_ON:
            return status, row
        budget -= 1

        renew_coordinates(switch, kinematic, own, span, n_q, state, vectors)
        h = cut(t, wanted, span[0])
        t_new = span[0] if h == span[0] - t else t + h
        asked = clipped(t_new, span[1], span[2])
        if not newton(correct, kinematic, advance, own, asked, h, rho, n_q, rtol, atol, state, vectors, scratch):
            newton_failed(0.5 * h, scratch[CHANGE], x, rtol, atol, state)
            continue
        normalise(y, renormalise)
        if not held_end(rate, kinematic, hold, own, asked, h * SHRINK, n_q, y, scratch[YDOT], state):
            continue
        set_error(kinematic, own, asked, h, rho, n_q, state, vectors, scratch)
        error = judged(h, 3, SHRINK, fixed, scratch[E], x, y, scratch[YDOT], rtol, atol, state)
        if error < 0.0:
            continue
        move_on(h, n_q, vectors, scratch)
        step_accepted(t_new, h, wanted, fixed, error, 3, SHRINK, GROW, state)
