"""Common parts of all disturbances, and the lines of their spectra.

A line is a force and a torque a cos(2 pi f t + phase) with complex amplitudes a (6,); the phases of different lines are
unknown and independent. A random disturbance has a one-sided power spectral density of each of its six components,
which are independent too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.noun.table import Table, refuse
from femflex.noun.values import counted_noun

COMPONENTS = tuple(f"{quantity}:{axis}" for quantity in ("force", "torque") for axis in "xyz")


@dataclass(frozen=True, eq=False)
class Line:
    """A line of a spectrum.

    order     frequency over the rate of the source: harmonic of a wheel or of a train of pulses
    frequency [Hz]
    amplitude (6,) complex: force [N] and torque [N m] in the axes of the marker
    """

    order: float
    frequency: float
    amplitude: ComplexArray


class Source(Table):
    """A source of disturbances: of lines, of a spectrum, or of both."""

    components: ClassVar[int] = 6  # of its lines and its spectrum

    @property
    def rates(self) -> tuple[float, float] | None:
        """Lowest and highest rate of the source [rad/s] if it is swept, else None."""
        return None

    @property
    def band(self) -> tuple[float, float] | None:
        """Lowest and highest frequency [Hz] of the source, as far as it has both."""
        return None

    def read_from(self, folder: Path) -> Self:
        """The source with the numbers of the files in that folder that it names. Raises ValueError, OSError."""
        return self

    def lines(self, rate: float | None, highest: float) -> list[Line]:
        """The lines at a rate [rad/s], by default its own, up to a frequency [Hz]."""
        return []

    def orders(self, highest: float) -> list[float]:
        """Frequencies over the rate of the lines that a swept source has up to a frequency [Hz]."""
        return [] if self.rates is None else sorted({line.order for line in self.lines(self.rates[0], highest)})

    def spectrum(self, frequencies: Array) -> Array:
        """One-sided spectral density (n, components) in squared SI units per Hz, at frequencies (n,) [Hz]."""
        return np.zeros((len(frequencies), self.components))

    def breaks(self) -> Array:
        """Frequencies (n,) [Hz] at which the spectrum has a kink or a jump."""
        return np.zeros(0)


class MarkerDisturbance(Source):
    """A disturbance that acts at a marker of a body, in the marker's axes."""

    body: str
    """Body on which it acts."""
    marker: str = "origin"
    """Marker at which it acts; the components are in the marker's axes."""


def log_interpolated(frequencies: Array, table: Array, values: Array) -> Array:
    """Values (n, ...) of a spectrum at frequencies (n,) [Hz], straight on log axes, zero outside of the table (m,).

    Between two values of which one is zero it is linear.
    """
    frequencies, table, values = np.asarray(frequencies, float), np.asarray(table, float), np.asarray(values, float)
    k = np.clip(np.searchsorted(table, frequencies, side="right") - 1, 0, len(table) - 2)
    low, high = values[k], values[k + 1]
    shape = (len(frequencies),) + (1,) * (values.ndim - 1)
    linear = ((frequencies - table[k]) / (table[k + 1] - table[k])).reshape(shape)
    share = (np.log(np.maximum(frequencies, 1e-300) / table[k]) / np.log(table[k + 1] / table[k])).reshape(shape)
    positive = (low > 0.0) & (high > 0.0)
    safe_low, safe_high = np.where(positive, low, 1.0), np.where(positive, high, 1.0)
    out = np.where(positive, safe_low * (safe_high / safe_low) ** share, low + linear * (high - low))
    inside = ((frequencies >= table[0]) & (frequencies <= table[-1])).reshape(shape)
    return np.asarray(np.where(inside, out, 0.0))


def check_frequencies(frequencies: tuple[float, ...], counts: dict[str, int]) -> None:
    """Refuse a table of a spectrum whose frequencies do not rise, or whose columns have other numbers of rows."""
    if len(frequencies) < 2 or any(b <= a for a, b in pairwise(frequencies)):
        refuse(f"found frequencies = {list(frequencies)}; give at least two, rising")
    for key, count in counts.items():
        if count != len(frequencies):
            counted = counted_noun(count, "row", "rows")
            refuse(f"found {counted} in {key} and {len(frequencies)} frequencies; give as many of both")


def perpendicular(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors (3,) that form a right-handed set with an axis (3,): x and y for an axis along z, and so on."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    k = int(np.argmax(np.abs(axis)))
    first = np.eye(3)[(k + 1) % 3]
    first = first - (first @ axis) * axis
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def range_of(single: float | None, pair: tuple[float, float] | None, keys: tuple[str, str]) -> None:
    """Refuse a rate and a range of rates together, neither of them, and a range that does not rise."""
    if (single is None) == (pair is None):
        refuse(f"found {'both' if pair else 'neither'} of {keys[0]} and {keys[1]}; give one of them")
    if pair is not None and not pair[0] < pair[1]:
        refuse(f"found {keys[1]} = {list(pair)}; the second must be above the first")
