"""Frequencies and weights of integrals of spectra that resolve every resonance."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femflex.arrays import Array, ComplexArray

PER_DECADE = 24  # panels on a log axis
AROUND = 2.0 ** np.arange(-1, 12)  # half widths of a resonance at which panels end
ORDER = 8  # points of Gauss in a panel
LEAST = 1e-7  # damping ratio of the narrowest resonance that is resolved


def frequency_panels(
    low: float, high: float, poles: ComplexArray, breaks: Iterable[Array] = ()
) -> tuple[Array, Array, Array]:
    """Frequencies (n,), weights (n,) and ends (n_p + 1,) of the panels of an integral from low to high [Hz].

    poles (m,) [1/s]: panels grow by a factor of two from each resonance on, so that Gauss's rule of 8 points is exact
    to rounding for oscillators.   breaks: frequencies [Hz] at which a spectrum has a kink.
    """
    decades = np.log10(high / low)
    ends = [np.geomspace(low, high, max(2, int(np.ceil(PER_DECADE * decades)) + 1)), *breaks]
    for pole in poles[poles.imag > 0]:
        width = max(-pole.real, LEAST * abs(pole))
        ends.append((pole.imag + width * np.concatenate([-AROUND, [0.0], AROUND])) / (2.0 * np.pi))
    edges = np.unique(np.concatenate(ends))
    edges = np.concatenate([[low], edges[(edges > low * (1 + 1e-12)) & (edges < high * (1 - 1e-12))], [high]])
    x, w = np.polynomial.legendre.leggauss(ORDER)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * w).ravel(), edges


def cumulative(values: Array, weights: Array) -> Array:
    """The integral (n_p + 1, ...) up to each end of the panels, of values (n, ...) [SI] at the points of their rule."""
    weighted = values * weights.reshape((-1,) + (1,) * (values.ndim - 1))
    panels = weighted.reshape((-1, ORDER, *values.shape[1:])).sum(axis=1)
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(panels, axis=0)])
