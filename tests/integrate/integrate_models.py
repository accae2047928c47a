"""Small compiled models with known motions, for the tests of the integrators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from femflex.integrate.protocol import RATE, SecondOrder

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Compiled:
    """A model by hand: its rate, its numbers, and where it is not smooth."""

    n_x: int
    rate: Callable[..., Any]
    pool: Array = field(default_factory=lambda: np.zeros(1))
    table: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    work: Array = field(default_factory=lambda: np.zeros(1))
    renormalise: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    breaks: Array = field(default_factory=lambda: np.zeros(0))
    second_order: SecondOrder | None = None


@njit(RATE, cache=True)
def oscillator_rate(t, x, dxdt, table, pool, work):
    """x0'' = -pool[0]^2 x0."""
    dxdt[0] = x[1]
    dxdt[1] = -pool[0] * pool[0] * x[0]


def oscillator(omega: float = 1.0) -> Compiled:
    """Harmonic oscillator, x = (position, velocity)."""
    return Compiled(2, oscillator_rate, np.array([omega]))
