"""Functions on the unit interval that satisfy a member's end conditions: characteristic functions and polynomials.

Every set is a function (xi, derivative) -> (len(xi), n), orthonormal over 0 <= xi <= 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from math import comb
from typing import Protocol

import numpy as np
from scipy.optimize import brentq
from scipy.special import poch, roots_legendre

from femflex.arrays import Array, IntArray
from femflex.fem.eigen.shift_invert import signs


class FunctionSet(Protocol):
    """Functions on the unit interval, or a derivative of them, at xi (k,): (k, n)."""

    def __call__(self, xi: Array, derivative: int = 0) -> Array:
        """Values or derivatives, (k, n)."""


SUPPORTS = ("free", "pinned", "clamped")
CONDITIONS = {"free": (2, 3), "pinned": (0, 2), "clamped": (0, 1)}  # derivatives that vanish at an end in bending


def ends_of(ends: str) -> tuple[str, str]:
    """Supports at root and tip from "root-tip", e.g. "clamped-free".

    Raises ValueError with the supports known.
    """
    root, _, tip = ends.partition("-")
    if root not in SUPPORTS or tip not in SUPPORTS:
        raise ValueError(
            f"ends {ends!r} are not understood; give root and tip as two of {list(SUPPORTS)}, as in 'clamped-free'."
        )
    return root, tip


@lru_cache(maxsize=64)
def gauss(n: int) -> tuple[Array, Array]:
    """Gauss–Legendre points and weights (n,) on the unit interval; read only."""
    x, w = roots_legendre(n)  # from a banded matrix: the cost of numpy's grows with the cube of n
    points, weights = np.asarray((x + 1) / 2, float), np.asarray(w / 2, float)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


# --- characteristic functions ---------------------------------------------------------------------------------------


def bending_roots(ends: str, n: int) -> Array:
    """The n lowest elastic roots beta L (n,) [1] of a uniform beam's frequency equation.

    Written with 1 / cosh and tanh, which do not overflow: cos b = -+1 / cosh b, tan b = tanh b, sin b = 0.
    """
    k = np.arange(1.0, n + 1)
    kind = frozenset(ends_of(ends))
    if kind == {"pinned"}:
        return k * np.pi
    if kind == {"clamped", "free"}:
        return np.array([_root(lambda b: np.cos(b) + _sech(b), (j - 1) * np.pi, j * np.pi) for j in k])
    if "pinned" in kind:
        return np.array([_root(lambda b: np.sin(b) - np.tanh(b) * np.cos(b), j * np.pi, (j + 0.5) * np.pi) for j in k])
    return np.array([_root(lambda b: np.cos(b) - _sech(b), j * np.pi, (j + 1) * np.pi) for j in k])


@lru_cache(maxsize=256)
def bending_characteristic(ends: str, n: int) -> FunctionSet:
    """Vibration shapes of a uniform Euler–Bernoulli beam, stable at any order.

    Each is a combination of cos b xi, sin b xi, exp(-b xi) and exp(-b (1 - xi)), all of size one at most, whose
    coefficients are the null vector of the four end conditions: no cosh and cos that cancel.
    """
    supports = ends_of(ends)
    roots = bending_roots(ends, n)
    coefficients = np.zeros((4, n))
    for j, b in enumerate(roots):
        rows = [
            _waves(np.array([at]), np.array([b]), d)[:, 0, 0]
            for at, s in zip((0.0, 1.0), supports, strict=True)
            for d in CONDITIONS[s]
        ]
        coefficients[:, j] = np.linalg.svd(np.array(rows))[2][-1]

    def functions(xi: Array, derivative: int = 0) -> Array:
        return roots**derivative * np.einsum("wkn,wn->kn", _waves(xi, roots, derivative), coefficients)

    return _normalised(functions, points_for(n))


@lru_cache(maxsize=256)
def axial_characteristic(ends: str, n: int) -> FunctionSet:
    """Vibration shapes of a uniform bar or shaft: sines and cosines; pinned and clamped ends are equivalent."""
    root, tip = (support != "free" for support in ends_of(ends))
    k: Array = np.arange(1.0, n + 1) - (0.5 if root != tip else 0.0)
    phase = -np.pi / 2 if root else 0.0  # sine from a fixed root, cosine from a free one

    def functions(xi: Array, derivative: int = 0) -> Array:
        waves = np.cos(np.outer(xi, k * np.pi) + phase + derivative * np.pi / 2)
        return np.asarray((k * np.pi) ** derivative * waves, float)

    return _normalised(functions, points_for(n))


def _waves(xi: Array, b: Array, derivative: int) -> Array:
    """cos b xi, sin b xi, exp(-b xi), exp(-b (1 - xi)) and their derivatives over b^derivative: (4, k, n) of b (n,)."""
    phase = np.outer(xi, b)
    cos, sin = np.cos(phase), np.sin(phase)
    turned = [(cos, sin), (-sin, cos), (-cos, -sin), (sin, -cos)][derivative % 4]
    return np.stack([*turned, (-1.0) ** derivative * np.exp(-phase), np.exp(-np.outer(1 - xi, b))])


def _root(f: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(f, low, high, xtol=1e-15, rtol=4 * np.finfo(float).eps))


def _sech(b: float) -> float:
    return float(2 * np.exp(-b) / (1 + np.exp(-2 * b)))


# --- polynomials ----------------------------------------------------------------------------------------------------


def polynomials(root_order: int, tip_order: int, n: int, rigid: int = 2) -> FunctionSet:
    """xi^p (1 - xi)^q times Jacobi polynomials: orthogonal, well conditioned at any degree.

    p, q: how many derivatives (value, slope) vanish at root and tip. With weights (2q, 2p) the Jacobi polynomials make
    the products orthogonal. Rigid motions that the ends allow are left out: in bending (rigid = 2) 1 and xi, or one
    of them; along and about the axis (rigid = 1) the constant.
    """
    p, q = root_order, tip_order
    degrees = np.arange(n) + max(0, rigid - p - q)

    def functions(xi: Array, derivative: int = 0) -> Array:
        total = np.zeros((len(xi), n))
        for i in range(derivative + 1):  # Leibniz over weight and polynomial
            weight = _weight(xi, p, q, derivative - i)
            total += comb(derivative, i) * weight[:, None] * _jacobi(degrees, 2 * q, 2 * p, xi, i)
        return total

    return _normalised(functions, n + p + q + 4)


def _jacobi(degrees: IntArray, a: int, b: int, xi: Array, derivative: int) -> Array:
    """Derivative of P_k^(a, b)(2 xi - 1) by xi: (k + a + b + 1)_d P_(k - d)^(a + d, b + d)."""
    lower, a, b, x = degrees - derivative, a + derivative, b + derivative, 2 * xi - 1
    P = [np.ones_like(x), (a + 1) + (a + b + 2) * (x - 1) / 2]
    for k in range(2, max(lower, default=0) + 1):  # DLMF 18.9.2
        s = 2 * k + a + b
        grown = (s - 1) * (s * (s - 2) * x + a * a - b * b) * P[-1] - 2 * (k + a - 1) * (k + b - 1) * s * P[-2]
        P.append(grown / (2 * k * (k + a + b) * (s - 2)))
    values = np.stack(P, axis=1)[:, np.maximum(lower, 0)]
    return np.where(lower >= 0, poch(degrees + a + b + 1.0 - 2 * derivative, derivative) * values, 0.0)


def _weight(xi: Array, p: int, q: int, derivative: int) -> Array:
    polynomial = np.polynomial.Polynomial([0.0, 1.0]) ** p * np.polynomial.Polynomial([1.0, -1.0]) ** q
    return np.asarray(polynomial.deriv(derivative)(xi) if derivative else polynomial(xi), float)


# --- static shapes --------------------------------------------------------------------------------------------------


STATIC_BENDING = (  # of a root that accelerates, w'''' = 1, and that starts to turn, w'''' = xi
    np.polynomial.Polynomial([0, 0, 1 / 4, -1 / 6, 1 / 24]),
    np.polynomial.Polynomial([0, 0, 1 / 6, -1 / 12, 0, 1 / 120]),
)
STATIC_AXIAL = (np.polynomial.Polynomial([0, 1, -1 / 2]),)  # of a root that accelerates, u'' = -1
TIP_BENDING = (np.polynomial.Polynomial([0, 0, 1 / 2]), np.polynomial.Polynomial([0, 0, 1 / 2, -1 / 6]))
TIP_AXIAL = (np.polynomial.Polynomial([0, 1]),)  # and those of a moment and a force at the tip


def with_static(functions: FunctionSet, shapes: Sequence[np.polynomial.Polynomial], n: int) -> FunctionSet:
    """Clamped-free functions with added static shapes, made orthonormal; n in all.

    Truncated modes leave out just these; see modes.with_attachment.
    """
    return _with_shapes(functions, list(shapes), points_for(n)) if shapes else functions


def _with_shapes(functions: FunctionSet, added: list[np.polynomial.Polynomial], n_points: int) -> FunctionSet:
    """The set with polynomials added, less their part in the set (projected twice: the rest is small)."""

    def everything(xi: Array, derivative: int = 0) -> Array:
        extra = [f.deriv(derivative)(xi) if derivative else f(xi) for f in added]
        return np.column_stack([functions(xi, derivative), *extra])

    xi, w = gauss(n_points)
    values = everything(xi, 0)
    n = values.shape[1]
    combine = np.eye(n)
    for j in range(n - len(added), n):
        for _ in range(2):
            column = values @ combine[:, j]
            combine[:, j] -= combine[:, :j] @ ((values @ combine[:, :j]).T @ (w * column))
        column = values @ combine[:, j]
        combine[:, j] /= np.sqrt(w @ column**2) * np.sign(column[-1])

    def combined(xi: Array, derivative: int = 0) -> Array:
        return everything(xi, derivative) @ combine

    return combined


def points_for(n: int) -> int:
    """Gauss points that integrate products of the n-th characteristic functions to rounding."""
    return 40 + 8 * n


def _normalised(functions: FunctionSet, n_points: int) -> FunctionSet:
    """The functions with unit square integral, the largest value positive (at the tip, if it is free)."""
    xi, w = gauss(n_points)
    values = functions(xi, 0)
    ends = functions(np.array([1.0, 0.0]), 0)  # the tip first: it wins a tie
    factor = signs(np.concatenate([ends, values])) / np.sqrt(w @ values**2)

    def normalised(xi: Array, derivative: int = 0) -> Array:
        return functions(xi, derivative) * factor

    return normalised
