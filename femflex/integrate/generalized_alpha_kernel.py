"""Compiled steps of the generalised-alpha method: Newton's iteration, filtered error, and the loop over steps.

Notation of Arnold & Bruels (2007), with u for the velocity and w = udot. The vectors kept between calls are (5, n_x):
x = (q, u), dx/dt, both at the beginning of the last step, and two slopes of w, each (n_u,): `g` = (a - w) / h, which
carries the method's own acceleration a over a change of step, and `s`, the (filtered) mean slope over the last step.
"""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, njit, types
from numpy.typing import NDArray

from femflex.integrate import resume as head
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
    reject,
    scaled_norm,
)
from femflex.integrate.protocol import ADVANCE, KINEMATIC, OWN, RESIDUAL, SOLVE, Call, Own
from femflex.integrate.vectors import accept, clipped, cut, first_not_finite, normalise, put

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Span = tuple[float, float, float]
Calls = tuple[Call, Call, Call, Call]  # residual, solve, kinematic, advance

SLOPES, N_VECTORS = 4, 5
# rows of the scratch vectors: end of the trial step, its rate, error, a correction in x; the rest are (n_u,)
Y, YDOT, E, CHANGE, INCREMENT, A_NEW, RIGHT, DELTA, VELOCITY = 0, 1, 2, 3, 4, 5, 6, 7, 8
N_SCRATCH = 9
SAFETY, SHRINK, GROW = 0.9, 0.3, 3.0


@njit
def parameters(rho: float) -> tuple[float, float, float, float]:
    """alpha_m, alpha_f, beta, gamma for the spectral radius rho at infinite frequency (Chung & Hulbert 1993)."""
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    return alpha_m, alpha_f, 0.25 * (1.0 - alpha_m + alpha_f) ** 2, 0.5 - alpha_m + alpha_f


@njit
def error_constants(rho: float) -> tuple[float, float]:
    """Leading errors of a step, C_q h^3 u'' in q and C_u h^3 u''' in u, by Taylor series; a leads w by d h."""
    alpha_m, alpha_f, beta, gamma = parameters(rho)
    d = alpha_m - alpha_f
    lag = 0.5 * ((1.0 - alpha_f) - (1.0 - alpha_m) * (1.0 + d) ** 2 - alpha_m * d**2)
    return 0.5 * d + beta - 1 / 6, 0.5 * ((1.0 - gamma) * d**2 + gamma * (1.0 + d) ** 2) + lag - 1 / 6
