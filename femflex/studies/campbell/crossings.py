"""Where a branch meets a multiple of the spin: f = n Omega / 2 pi."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Crossing:
    """A branch at the frequency of an excitation that comes `order` times in every turn."""

    branch: str
    order: int
    speed: float  # rad/s
    frequency: float  # Hz


def crossings(branch: str, speeds: Array, frequencies: Array, orders: list[int]) -> list[Crossing]:
    """The crossings of a branch's frequencies (n,) [Hz] over speeds (n,) [rad/s], by rising speed.

    Between speeds the squares are interpolated, which centrifugal stiffening makes nearly straight.
    """
    swings = frequencies > 0
    parts = np.flatnonzero(np.diff(np.concatenate([[False], swings, [False]]).astype(int))).reshape(-1, 2)
    out = []
    for first, end in parts:
        if end - first < 2:
            continue
        z, y = speeds[first:end] ** 2, (2 * np.pi * frequencies[first:end]) ** 2
        curve = CubicSpline(z, y) if len(z) > 3 else lambda at, z=z, y=y: np.interp(at, z, y)
        out += [found for order in orders for found in _meetings(branch, order, z, y, curve)]
    return sorted(out, key=lambda crossing: crossing.speed)


def _meetings(branch: str, order: int, z: Array, y: Array, curve: object) -> list[Crossing]:
    gap = y - order**2 * z
    out = []
    for k in np.flatnonzero(gap[:-1] * gap[1:] <= 0):
        if gap[k] == 0 and k > 0:  # told at the end of the interval before
            continue
        at = z[k] if gap[k] == 0 else brentq(lambda s: float(curve(s)) - order**2 * s, z[k], z[k + 1])  # type: ignore[operator]
        out.append(Crossing(branch, order, float(np.sqrt(at)), order * float(np.sqrt(at)) / (2 * np.pi)))
    return out
