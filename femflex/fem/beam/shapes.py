"""Shape functions of a straight two-node beam element, hierarchical in the polynomial order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]

NODAL = 12  # u, v, w, theta_x, theta_y, theta_z at both ends


@dataclass(frozen=True)
class BeamOrder:
    """Polynomial orders of an element: bending at least 3, axial and torsional at least 1."""

    bending: int
    axial: int
    torsion: int

    @property
    def n_local(self) -> int:
        """Number of element dofs: 12 at the nodes, then bubbles of u, theta, v and w."""
        return NODAL + (self.axial - 1) + (self.torsion - 1) + 2 * (self.bending - 3)


def field_rows(order: BeamOrder, xi: Array, h: Array, derivative: int) -> Array:
    """Rows of u, v, w, theta (or their d/dx to the given order) at positions xi (q,) in [0, 1]: (e, q, 4, n_local).

    Local dofs in the element's axes, lengths h (e,). Bending slopes are rotations: theta_z = v', theta_y = -w'.
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
    return rows


def _linear(order: int, xi: Array, derivative: int) -> Array:
    """End functions 1 - xi, xi and the bubbles int P_{k-1}, k = 2 ... order, at xi: (q, order + 1)."""
    ends = [Polynomial([1.0, -1.0]), Polynomial([0.0, 1.0])]
    bubbles = [_scaled(k - 1, 1) for k in range(2, order + 1)]
    return _evaluated([*ends, *bubbles], xi, derivative)


def _hermite(order: int, xi: Array, derivative: int) -> Array:
    """Cubic Hermite functions and the bubbles int int P_{k-2}, k = 4 ... order, at xi: (q, order + 1)."""
    value_0, slope_0 = Polynomial([1.0, 0.0, -3.0, 2.0]), Polynomial([0.0, 1.0, -2.0, 1.0])
    value_1, slope_1 = Polynomial([0.0, 0.0, 3.0, -2.0]), Polynomial([0.0, 0.0, -1.0, 1.0])
    bubbles = [_scaled(k - 2, 2) for k in range(4, order + 1)]
    return _evaluated([value_0, slope_0, value_1, slope_1, *bubbles], xi, derivative)


def _scaled(degree: int, times: int) -> Legendre:
    """Legendre polynomial on [0, 1], normalised and integrated from 0; zero with its slopes at both ends."""
    base = np.sqrt(2 * degree + 1) * Legendre.basis(degree, domain=[0.0, 1.0])
    return base.integ(times, lbnd=0.0)


def _evaluated(functions: list[Polynomial | Legendre], xi: Array, derivative: int) -> Array:
    return np.stack([f.deriv(derivative)(xi) if derivative else f(xi) for f in functions], axis=-1)
