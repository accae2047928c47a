"""Gauss points over intervals between knots, and functions that are polynomials on each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from femflex.arrays import Array
from femflex.reduction.beams.beam_functions import gauss

LEAST_POINTS = 12  # on an interval between two knots


def gauss_between(knots: Array, n: int) -> tuple[Array, Array]:
    """Points (q,) and weights (q,) [1] over 0 <= xi <= 1: n points, divided among the intervals between knots, with at
    least LEAST_POINTS in each if there are inner knots."""
    edges = np.concatenate([[0.0], knots, [1.0]])
    intervals = len(edges) - 1
    x, w = gauss(n if intervals == 1 else max(LEAST_POINTS, -(-n // intervals)))
    size = np.diff(edges)[:, None]
    return (edges[:-1, None] + size * x).ravel(), (size * w).ravel()


@dataclass(frozen=True, eq=False)
class PiecewisePolynomials:
    """Functions that are polynomials between knots.

    edges         (k + 1,)     ends of the intervals, from 0 to 1
    coefficients  (k, m, n)    of Legendre polynomials in -1 ... 1 over each interval
    """

    edges: Array
    coefficients: Array

    def __call__(self, xi: Array, derivative: int = 0) -> Array:
        """Values or a derivative by xi (len(xi), n)."""
        values = np.zeros((len(xi), self.coefficients.shape[2]))
        inside = np.clip(np.searchsorted(self.edges, xi, side="right") - 1, 0, len(self.edges) - 2)
        for k in np.unique(inside):
            in_interval, a, b = inside == k, self.edges[k], self.edges[k + 1]
            series = self.coefficients[k]
            series = legendre.legder(series, derivative) * (2.0 / (b - a)) ** derivative if derivative else series
            values[in_interval] = legendre.legval((2.0 * xi[in_interval] - a - b) / (b - a), series, tensor=True).T
        return values


def integral_of(edges: Array, values: Array, degree: int) -> PiecewisePolynomials:
    """The integral from 0 of functions with values (k, q, n), in any unit, at the q Gauss points of each interval.

    degree: of the polynomials that are fitted to the functions on each interval.
    """
    x, w = np.polynomial.legendre.leggauss(values.shape[1])
    P = legendre.legvander(x, degree)
    fit = (2.0 * np.arange(degree + 1) + 1.0)[:, None] / 2.0 * (P.T * w)  # (degree + 1, q)
    size = np.diff(edges)
    parts, start = [], np.zeros(values.shape[2])
    for k, interval_values in enumerate(values):
        part = np.asarray(legendre.legint(fit @ interval_values, lbnd=-1), float) * size[k] / 2.0
        part[0] += start
        start = part.sum(axis=0)  # every Legendre polynomial is 1 at the end
        parts.append(part)
    return PiecewisePolynomials(edges, np.stack(parts))
