"""Fields of the rectangle of Bogner, Fox and Schmit (1965) with a biquadratic in-plane field.

Coordinates xi, eta in [-1, 1] from the middle, half lengths a, b along the element's axes. Bending dofs at each corner
(w, theta_x, theta_y, twist) = (w, w,y, -w,x, w,xy); w is the bicubic Hermite interpolation, continuous with its
slopes, and normals stay perpendicular: beta = -grad w, without transverse shear.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import polynomial

from femflex.arrays import Array

# Corners counterclockwise; sides from each corner to the next.
XI, ETA = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])


def hermite(s: float, value: bool) -> Array:
    """Coefficients (4,) [1] of the cubic with value 1 (or, unless `value`, slope 1) at s = -1 or 1.

    The other of the two is zero there, and both are zero at -s.
    """
    return np.array([2, 3 * s, 0, -s]) / 4 if value else np.array([-s, -1, s, 1]) / 4


def deflection(xi: Array, eta: Array, order: tuple[int, int]) -> Array:
    """Derivative (q, 16) [m per dof], order times by xi and eta, of w over the dofs (w, w,eta, w,xi, w,xi eta) of
    each corner.

    The array is read only and cached, because the table of each of a few rules is needed for every chunk of elements.
    """
    return _deflection(xi.tobytes(), eta.tobytes(), order)


@lru_cache(maxsize=64)
def _deflection(xi_bytes: bytes, eta_bytes: bytes, order: tuple[int, int]) -> Array:
    xi, eta = np.frombuffer(xi_bytes), np.frombuffer(eta_bytes)
    columns = []
    for s, t in zip(XI, ETA, strict=True):
        for by_xi, by_eta in ((True, True), (True, False), (False, True), (False, False)):
            along = polynomial.polyder(hermite(s, by_xi), order[0])
            across = polynomial.polyder(hermite(t, by_eta), order[1])
            columns.append(polynomial.polyval(xi, along) * polynomial.polyval(eta, across))
    return _read_only(np.stack(columns, axis=1))


def dof_scale(a: Array, b: Array) -> Array:
    """Factors (e, 16) [1, m, m^2] that convert (w, theta_x, theta_y, twist) of each corner to (w, w,eta, w,xi, w,xi
    eta)."""
    return np.tile(np.stack([np.ones_like(a), b, -a, a * b], axis=1), 4)


def deflection_and_rotation(xi: Array, eta: Array, a: Array, b: Array) -> Array:
    """w [m], beta_x, beta_y [rad] (e, q, 3, 16), per dof, of rectangles with half lengths a, b (e,)."""
    reference = [deflection(xi, eta, order) for order in ((0, 0), (1, 0), (0, 1))]
    return _scaled(reference, [np.ones_like(a), -1 / a, -1 / b], a, b)


def curvatures(xi: Array, eta: Array, a: Array, b: Array) -> Array:
    """kappa (3) [1/m] = -(w,xx  w,yy  2 w,xy) of rectangles with half lengths a, b (e,): (e, q, 3, 16)."""
    reference = [deflection(xi, eta, order) for order in ((2, 0), (0, 2), (1, 1))]
    return _scaled(reference, [-1 / a**2, -1 / b**2, -2 / (a * b)], a, b)


def inplane_shapes(xi: Array, eta: Array) -> Array:
    """In-plane shape functions (q, 9) [1]: corners, deviation from the straight line on sides, bubble."""
    return np.stack([f(xi) * g(eta) for f, g in _INPLANE], axis=1)


def inplane_gradients(xi: Array, eta: Array, a: Array, b: Array) -> Array:
    """Their derivatives by x and y (e, q, 2, 9) [1/m] on rectangles with half lengths a, b (e,)."""
    dx, dy = _inplane_derivatives(xi.tobytes(), eta.tobytes())
    return np.stack([dx / a[:, None, None], dy / b[:, None, None]], axis=2)


@lru_cache(maxsize=64)
def _inplane_derivatives(xi_bytes: bytes, eta_bytes: bytes) -> tuple[Array, Array]:
    """Derivatives (q, 9) of the in-plane shape functions by xi and eta, read only."""
    xi, eta = np.frombuffer(xi_bytes), np.frombuffer(eta_bytes)
    dx = np.stack([f.deriv()(xi) * g(eta) for f, g in _INPLANE], axis=1)
    dy = np.stack([f(xi) * g.deriv()(eta) for f, g in _INPLANE], axis=1)
    return _read_only(dx), _read_only(dy)


def _read_only(table: Array) -> Array:
    table.setflags(write=False)
    return table


def _scaled(reference: list[Array], rows: list[Array], a: Array, b: Array) -> Array:
    table = np.stack(reference, axis=1)  # (q, rows, 16)
    return table * np.stack(rows, axis=1)[:, None, :, None] * dof_scale(a, b)[:, None, None, :]


def _inplane_factors() -> list[tuple[polynomial.Polynomial, polynomial.Polynomial]]:
    """The in-plane shape functions as products of polynomials of xi and of eta."""
    bump = polynomial.Polynomial([1, 0, -1])
    slope = {s: polynomial.Polynomial([0.5, s / 2]) for s in (-1.0, 1.0)}
    corners = [(slope[s], slope[t]) for s, t in zip(XI, ETA, strict=True)]
    sides = [(bump, slope[-1.0]), (slope[1.0], bump), (bump, slope[1.0]), (slope[-1.0], bump)]
    return [*corners, *sides, (bump, bump)]


_INPLANE = _inplane_factors()
