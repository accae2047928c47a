"""Frequencies at which the response of a linear model is drawn, denser near its poles."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.studies.linear.space import StateSpace

SLOW = 1e-6  # of the largest pole: slower ones are rigid-body motion
DECADES = 3.0  # above the slowest vibration, at most
POINTS = 1500  # over the whole range
AROUND = np.concatenate([-np.geomspace(30, 0.1, 12), [0.0], np.geomspace(0.1, 30, 12)])  # half widths of a resonance
LEAST = 1e-5  # damping ratio by which an undamped pole is passed


def response_grid(model: StateSpace, lowest: float | None = None, highest: float | None = None) -> Array:
    """Frequencies (n,) [rad/s] from a tenth of the slowest vibration to three times the fastest, or lowest to highest.

    None of them is at an undamped pole.
    """
    poles = model.eigenvalues()
    size = np.abs(poles)
    moving = size[size > SLOW * size.max(initial=0.0)]
    low, high = (0.1 * moving.min(), 3.0 * moving.max()) if len(moving) else (0.1, 10.0)
    low, high = lowest or low, highest or min(high, low * 10 ** (DECADES + 1))
    if not 0 < low < high:
        raise ValueError(
            f"the response is to go from {low:.4g} to {high:.4g} rad/s; give two rising frequencies above 0"
        )
    resonances = [
        p.imag + AROUND * max(-p.real, LEAST * abs(p)) for p in poles if p.imag > SLOW * size.max() and abs(p) <= high
    ]
    grid = np.unique(np.concatenate([np.geomspace(low, high, POINTS), *resonances]))
    grid = grid[(grid >= low) & (grid <= high)]
    undamped = poles[np.abs(poles.real) <= LEAST * np.abs(poles)]
    distance = np.abs(grid[:, None] - np.abs(undamped.imag)[None]).min(axis=1, initial=np.inf)
    return grid[distance > 0.05 * LEAST * grid]
