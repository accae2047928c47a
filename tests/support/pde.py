"""Travelling members from their partial differential equations, in the strong form, on polynomials of their own.

Nothing here comes from femflex. At a material point, xi = x / L, D = d/dt + c d/dxi with c = U (1 - xi) / L.
"""

import numpy as np
from numpy.polynomial.legendre import Legendre
from scipy.integrate import solve_ivp


def basis(conditions, count):
    """Polynomials (Legendre series on 0..1) that meet the conditions [(xi, derivative), ...], lowest degrees first."""
    size = count + len(conditions)
    unit = [Legendre.basis(k, domain=[0, 1]) for k in range(size)]
    rows = np.array([[(p.deriv(d) if d else p)(at) for p in unit] for at, d in conditions])
    null = []
    for k in range(count):  # k-th: degrees k .. k + conditions, which leaves one combination
        part = rows[:, k : k + len(conditions) + 1]
        part = part / np.abs(part).max(axis=1, keepdims=True)
        c = np.linalg.svd(part)[2][-1]
        null.append(sum((c[j] * unit[k + j] for j in range(len(c))), 0 * unit[0]))
    return null


def solution(psi, spatial, length, start, times, rtol=1e-8):
    """xi -> deflections (n_t, len(xi)) of D^2 y + spatial(xi, L, U, A, derivatives of y) = 0 by Galerkin's method.

    spatial: (xi, L, U, A, y, y1, y2, y4) -> value; start: (y(xi), y_t(xi)); length: t -> (L, U, A).
    """
    xi, w = np.polynomial.legendre.leggauss(3 * len(psi) + 10)
    xi, w = (xi + 1) / 2, w / 2
    Y = [np.array([(p.deriv(d) if d else p)(xi) for p in psi]).T for d in (0, 1, 2, 3, 4)]
    M = Y[0].T @ (w[:, None] * Y[0])
    project = np.linalg.solve(M, Y[0].T * w)

    def rate(t, x):
        L, U, A = (float(v) for v in length(t))
        a, da = np.split(x, 2)
        y, y1, y2, y4 = (Y[d] @ a for d in (0, 1, 2, 4))
        v1 = Y[1] @ da
        c = U / L * (1 - xi)
        ct = (A / L - U**2 / L**2) * (1 - xi)
        convected = 2 * c * v1 + c**2 * y2 + (ct - (U / L) * c) * y1
        return np.concatenate([da, -project @ (convected + spatial(xi, L, U, A, y, y1, y2, y4))])

    x0 = np.concatenate([project @ start[0](xi), project @ start[1](xi)])
    found = solve_ivp(rate, (times[0], times[-1]), x0, "DOP853", times, rtol=rtol, atol=1e-13).y.T
    return lambda at: found[:, : len(psi)] @ np.array([p(at) for p in psi])


CLAMPED_FREE = [(0, 0), (0, 1), (1, 2), (1, 3)]


def beam_from_a_wall(length, start, times, EI=1.0, m=1.0, count=12):
    """m' [w_tt + 2U w_xt + U^2 w_xx + A (L - x) w_xx] + EI w_xxxx = 0, clamped at x = 0, free at x = L."""

    def spatial(xi, L, U, A, y, y1, y2, y4):
        return EI / (m * L**4) * y4 + A / L * (1 - xi) * y2 - A / L * y1  # D^2 holds A w_x

    return solution(basis(CLAMPED_FREE, count), spatial, length, start, times)


def rod_from_a_wall(length, start, times, stiffness, inertia, count=10):
    """I D^2 y = S y_xx on a travelling member, y = 0 at x = 0 and y_x = 0 at x = L: twist, or transverse of a string.

    Stretch has the inertia force I dU/dt besides.
    """

    def spatial(xi, L, U, A, y, y1, y2, y4):
        return -stiffness / (inertia * L**2) * y2

    return solution(basis([(0, 0), (1, 1)], count), spatial, length, start, times)


def stretch_from_a_wall(length, start, times, EA, m, count=10):
    """m' (D^2 u + dU/dt) = EA u_xx: axial displacement of a member that is pushed out."""

    def spatial(xi, L, U, A, y, y1, y2, y4):
        return -EA / (m * L**2) * y2 + A

    return solution(basis([(0, 0), (1, 1)], count), spatial, length, start, times)


def string_between_supports(length, start, times, tension, m, count=10):
    """m' D^2 w = (N w_x)_x, N = T - m' A (L - x), w = 0 at x = 0 and at x = L, where T is held."""

    def spatial(xi, L, U, A, y, y1, y2, y4):
        return -(tension / (m * L**2) - A / L * (1 - xi)) * y2 - A / L * y1

    return solution(basis([(0, 0), (1, 0)], count), spatial, length, start, times)
