"""Shape functions of a straight two-node beam element, hierarchical in the polynomial order."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from femflex.arrays import Array

Function = Legendre | Polynomial

LINEAR = (1.0, -1.0), (0.0, 1.0)  # coefficients of the end functions
HERMITE = (1.0, 0.0, -3.0, 2.0), (0.0, 1.0, -2.0, 1.0), (0.0, 0.0, 3.0, -2.0), (0.0, 0.0, -1.0, 1.0)
NODAL = 12  # u, v, w, theta_x, theta_y, theta_z at both ends


@dataclass(frozen=True)
class BeamOrder:
    """Polynomial orders of an element: bending at least 3, axial and torsional at least 1.

    shear: whether it shears; it then has bending - 2 dofs of shear strain in each plane, after all others
    """

    bending: int
    axial: int
    torsion: int
    shear: bool = False

    @property
    def n_shear(self) -> int:
        """Number of dofs of shear strain in each plane."""
        return self.bending - 2 if self.shear else 0

    @property
    def n_local(self) -> int:
        """Number of element dofs: 12 at the nodes, bubbles of u, theta, v and w, shear strains along y and z."""
        return NODAL + (self.axial - 1) + (self.torsion - 1) + 2 * (self.bending - 3) + 2 * self.n_shear


def field_rows(order: BeamOrder, xi: Array, h: Array, derivative: int) -> Array:
    """Rows of u, v, w, theta (or their d/dx to the given order) at positions xi (q,) in [0, 1]: (e, q, 4, n_local).

    Local dofs in the element's axes, lengths h (e,). Bending slopes are rotations: theta_z = v', theta_y = -w', less
    shear strains where the element has some: v' = theta_z + gamma_y, w' = -theta_y + gamma_z.
    """
    rows = np.zeros((len(h), len(xi), 4, order.n_local))
    scale = h[:, None, None] ** -derivative
    hermite = scale * _hermite(order.bending, xi, derivative)
    hermite[:, :, [1, 3]] *= h[:, None, None]
    counts = (order.axial - 1, order.torsion - 1, order.bending - 3, order.bending - 3)
    starts = NODAL + np.cumsum([0, *counts[:-1]])
    bubbles = [start + np.arange(n) for start, n in zip(starts, counts, strict=True)]
    rows[:, :, 0][:, :, [0, 6, *bubbles[0]]] = scale * _linear(order.axial, xi, derivative)
    rows[:, :, 3][:, :, [3, 9, *bubbles[1]]] = scale * _linear(order.torsion, xi, derivative)
    rows[:, :, 1][:, :, [1, 5, 7, 11, *bubbles[2]]] = hermite
    hermite[:, :, [1, 3]] *= -1
    rows[:, :, 2][:, :, [2, 4, 8, 10, *bubbles[3]]] = hermite
    if order.shear:
        ends = _legendre(order.n_shear, np.array([0.0, 1.0]), 0)
        slopes = scale * _hermite(order.bending, xi, derivative)[:, [1, 3]] * h[:, None, None]
        for field, columns in zip((1, 2), shear_columns(order), strict=True):
            rows[:, :, field][:, :, columns] = np.matmul(slopes, ends)
    return rows


def shear_columns(order: BeamOrder) -> tuple[slice, slice]:
    """Columns of the shear strains along y and along z."""
    n = order.n_shear
    return slice(order.n_local - 2 * n, order.n_local - n), slice(order.n_local - n, order.n_local)


def shear_rows(order: BeamOrder, xi: Array, h: Array, derivative: int) -> Array:
    """gamma_y and gamma_z (e, q, 2, n_local) [rad per dof] at xi (q,), or their d/dx [1/m]; zero without shear."""
    rows = np.zeros((len(h), len(xi), 2, order.n_local))
    if order.shear:
        values = h[:, None, None] ** -derivative * _legendre(order.n_shear, xi, derivative)
        for field, columns in enumerate(shear_columns(order)):
            rows[:, :, field, columns] = values
    return rows


@lru_cache(maxsize=64)
def _functions(ends: tuple[tuple[float, ...], ...], times: int, n: int, derivative: int) -> list[Function]:
    """Polynomials of the ends, by their coefficients, and n of Legendre on [0, 1], integrated some times from 0.

    Integrated ones are normalised, and of the degrees from `times` on: zero with so many derivatives at both ends.
    """
    functions: list[Function] = [Polynomial(coefficients) for coefficients in ends]
    for degree in range(times, times + n):
        base = (np.sqrt(2 * degree + 1) if times else 1.0) * Legendre.basis(degree, domain=[0.0, 1.0])
        functions.append(base.integ(times, lbnd=0.0))
    return [f.deriv(derivative) if derivative else f for f in functions]


def _legendre(n: int, xi: Array, derivative: int) -> Array:
    """Legendre polynomials on [0, 1] of degree 0 ... n - 1 at xi: (q, n)."""
    return np.stack([f(xi) for f in _functions((), 0, n, derivative)], axis=-1)


def _linear(order: int, xi: Array, derivative: int) -> Array:
    """End functions 1 - xi, xi and the bubbles int P_{k-1}, k = 2 ... order, at xi: (q, order + 1)."""
    return np.stack([f(xi) for f in _functions(LINEAR, 1, order - 1, derivative)], axis=-1)


def _hermite(order: int, xi: Array, derivative: int) -> Array:
    """Cubic Hermite functions and the bubbles int int P_{k-2}, k = 4 ... order, at xi: (q, order + 1)."""
    return np.stack([f(xi) for f in _functions(HERMITE, 2, order - 3, derivative)], axis=-1)
