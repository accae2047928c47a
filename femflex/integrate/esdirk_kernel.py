"""Compiled steps of the order-4 implicit Runge-Kutta method: Newton's iteration of a stage, and the loop over steps.

Stage s solves M udot_s = Q - h at q_s = q + h sum_j A[s, j] N(q_j) u_j, u_s = u + h sum_j A[s, j] udot_j, and
zdot_s = f at z_s likewise; the last one is the end of the step. With v = (u, z) the vectors kept between calls are
(4, n_x): x = (q, v), dx/dt, and both at the beginning of the last step. k (6, n_x) holds dx/dt = (N u, vdot) of the
stages.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.integrate import resume as head
from femflex.integrate.compiled import ENDED, INDICES, INTEGER, REAL, SPAN, TABLE, VECTOR, kernel, part, types
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
    interpolate,
    newton_failed,
    projected_end,
    renew_coordinates,
    tested_error,
)
from femflex.integrate.protocol import CORRECT, KINEMATIC, MODEL_ARRAYS, RATE, SWITCH, Call, ModelArrays
from femflex.integrate.step_control import scaled_norm, shortened_step, step_accepted, step_status
from femflex.integrate.vectors import PROJECTION, Projection, clipped, copy_vector, normalise, write_rows

Span = tuple[float, float, float]

N_STAGES = 6
# rows of the scratch vectors: the stage, its part from earlier stages, error, a correction in x; the rest (n_v,)
Y, BASE, E, CHANGE, DELTA = 0, 1, 2, 3, 4
N_SCRATCH = 5
SHRINK, GROW = 0.25, 4.0
STAGES = [
    "0",
    "1/4 1/4",
    "8611/62500 -1743/31250 1/4",
    "5012029/34652500 -654441/2922500 174375/388108 1/4",
    "15267082809/155376265600 -71443401/120774400 730878875/902184768 2285395/8070912 1/4",
    "82889/524892 0 15625/83664 69875/102672 -2260/8211 1/4",
]
EMBEDDED = "4586570599/29645900160 0 178811875/945068544 814220225/1159782912 -3700637/11593932 61727/225920"

Calls = tuple[Projection, Call, Call, Call, Call]  # projection, rate, correct, kinematic, switch
Tolerances = tuple[float, Array]  # relative and absolute
Storage = tuple[Array, Array, Array, Array]  # resume state, kept vectors, stages and scratch


@part
def begin_stage(
    kinematic: Call, arrays: ModelArrays, s: int, t: float, h: float, n_q: int, x: Array, k: Array, scratch: Array
) -> None:
    """Set the known part of stage s, scratch[BASE], and the first guess of the stage, scratch[Y] and k[s]."""
    base, y = scratch[BASE], scratch[Y]
    for i in range(x.size):
        base[i], k[s, i] = x[i], 0.0
        for j in range(s):
            base[i] += h * A[s, j] * k[j, i]
            k[s, i] += GUESS[s, j] * k[j, i]
        y[i] = base[i] + h * GAMMA * k[s, i]
    kinematic(t, y[:n_q], y[n_q:], k[s][:n_q], *arrays)
    for i in range(n_q):  # the guess of q must be consistent with that of v: Newton's matrix relies on it
        y[i] = base[i] + h * GAMMA * k[s, i]


@part
def stage(
    calls: Calls, arrays: ModelArrays, s: int, t: float, h: float, n_q: int, tolerances: Tolerances, storage: Storage
) -> bool:
    """Whether Newton's method found stage s, scratch[Y] and k[s]; its matrix is M + (gamma h) D + (gamma h)^2 K."""
    _, _, correct, kinematic, _ = calls
    (rtol, atol), (state, vectors, k, scratch) = tolerances, storage
    x = vectors[X]
    begin_stage(kinematic, arrays, s, t, h, n_q, x, k, scratch)
    y, base, change = scratch[Y], scratch[BASE], scratch[CHANGE]
    n_v = x.size - n_q
    q, v, qdot, vdot = y[:n_q], y[n_q:], k[s][:n_q], k[s][n_q:]
    delta = scratch[DELTA][:n_v]
    g = GAMMA * h
    before = 0.0
    for iteration in range(MAX_ITERATIONS):
        correct(t, q, v, vdot, delta, g, g**2, *arrays)
        state[head.EVALUATIONS] += 1
        for i in range(n_v):
            vdot[i] += delta[i]
            change[n_q + i] = g * delta[i]
            v[i] += g * delta[i]
        kinematic(t, q, v, qdot, *arrays)
        for i in range(n_q):
            new = base[i] + g * qdot[i]
            change[i] = new - q[i]
            q[i] = new
        size = scaled_norm(change, x, y, rtol, atol)
        theta = contraction(iteration, size, before, state[head.CONTRACTION])
        if not math.isfinite(size) or (iteration > 0 and theta > SLOWEST and size > KAPPA):
            return False
        state[head.CONTRACTION] = min(theta, SLOWEST)
        if converged(theta, size):
            return True
        before = size
    return False


@part
def stages(
    calls: Calls, arrays: ModelArrays, span: Span, h: float, n_q: int, tolerances: Tolerances, storage: Storage
) -> bool:
    """Whether Newton's method found all stages of a step of size h; scratch[Y] is its end, scratch[E] its error."""
    state, vectors, k, scratch = storage
    x = vectors[X]
    copy_vector(vectors[XDOT], k[0])
    for s in range(1, N_STAGES):
        t = clipped(state[head.T] + C[s] * h, span[1], span[2])
        if not stage(calls, arrays, s, t, h, n_q, tolerances, storage):
            return False
    for i in range(x.size):
        scratch[E, i] = 0.0
        for s in range(N_STAGES):
            scratch[E, i] += h * ERROR[s] * k[s, i]
    return True


_CALLS = types.Tuple((PROJECTION, *(types.FunctionType(call) for call in (RATE, CORRECT, KINEMATIC, SWITCH))))
_SETTINGS = types.Tuple((REAL, REAL, VECTOR, REAL))
_STORAGE = types.Tuple((VECTOR, TABLE, TABLE, TABLE))
_SIGNATURE = ENDED(_CALLS, MODEL_ARRAYS, SPAN, INDICES, INTEGER, _SETTINGS, _STORAGE, VECTOR, TABLE, INTEGER)


@kernel(_SIGNATURE)
def fill(
    calls: Calls,
    arrays: ModelArrays,
    span: Span,
    renormalise: IntArray,
    n_q: int,
    settings: tuple[float, float, Array, float],
    storage: Storage,
    times: Array,
    rows: Array,
    budget: int,
) -> tuple[int, int]:
    """Take at most `budget` trial steps; return the status (FULL, END, PAUSE, STUCK) and the number of rows written.

    settings: fixed step, relative and absolute tolerance, the longest step. With a fixed step above 0 every step that
    converges is accepted and has that size. storage: resume state, kept vectors, stages and scratch
    """
    projection, rate, _, kinematic, switch = calls
    fixed, rtol, atol, max_step = settings
    tolerances = (rtol, atol)
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

        renew_coordinates(switch, kinematic, arrays, span, n_q, state, vectors)
        h = shortened_step(t, h_planned, span[0])
        if not stages(calls, arrays, span, h, n_q, tolerances, storage):
            newton_failed(0.5 * h, scratch[CHANGE], x, rtol, atol, state)
            continue
        t_new = span[0] if h == span[0] - t else t + h
        normalise(y, renormalise)
        t_inside = clipped(t_new, span[1], span[2])
        if not projected_end(rate, kinematic, projection, arrays, t_inside, h * SHRINK, n_q, y, k[5], state):
            continue
        error = tested_error(h, 4, SHRINK, fixed, scratch[E], x, y, k[5], tolerances, state)
        if error < 0.0:
            continue
        copy_vector(x, vectors[X_OLD])
        copy_vector(vectors[XDOT], vectors[XDOT_OLD])
        copy_vector(y, x)
        copy_vector(k[5], vectors[XDOT])
        step_accepted(t_new, h, h_planned, fixed, error, 4, SHRINK, GROW, state)


# Coefficients of the method ARK4(3)6L[2]SA-ESDIRK: order 4, stiffly accurate, L-stable, embedded order 3.
#
# Source: C. A. Kennedy, M. H. Carpenter, Additive Runge-Kutta schemes for convection-diffusion-reaction equations,
# Applied Numerical Mathematics 44 (2003) 139-181, implicit part; exact fractions.


def fractions(row: str) -> list[Fraction]:
    """The six exact coefficients of a row."""
    entries = [Fraction(text) for text in row.split()]
    return entries + [Fraction(0)] * (6 - len(entries))


def _guesses(c: Array) -> Array:
    """Weights of the earlier stages' accelerations whose sum is the first guess of each stage's.

    The polynomial of degree 2 at most through the last three earlier stages, taken at the stage's time.
    """
    weights = np.zeros((6, 6))
    for s in range(1, 6):
        nodes = range(max(0, s - 3), s)
        for j in nodes:
            weights[s, j] = np.prod([(c[s] - c[i]) / (c[j] - c[i]) for i in nodes if i != j])
    return weights


A = np.array([[float(a) for a in fractions(row)] for row in STAGES])
C = A.sum(axis=1)
ERROR = A[5] - np.array([float(b) for b in fractions(EMBEDDED)])
GUESS = _guesses(C)
GAMMA = 0.25
