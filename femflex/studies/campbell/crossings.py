"""Crossings of a branch with a multiple of the spin: f = n Omega / 2 pi."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from femflex.arrays import Array

ROUNDING = 1e-12  # of a squared frequency: a sample this close to a multiple of the spin is a crossing itself


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
    intervals = np.flatnonzero(np.diff(np.concatenate([[False], swings, [False]]).astype(int))).reshape(-1, 2)
    out = []
    for start, end in intervals:
        if end - start < 2:
            continue
        z, y = speeds[start:end] ** 2, (2 * np.pi * frequencies[start:end]) ** 2
        curve = CubicSpline(z, y) if len(z) > 3 else lambda square, z=z, y=y: np.interp(square, z, y)
        out += [point for order in orders for point in _crossings_of_order(branch, order, z, y, curve)]
    return sorted(out, key=lambda crossing: crossing.speed)


def _crossings_of_order(branch: str, order: int, z: Array, y: Array, curve: object) -> list[Crossing]:
    gap = np.where(np.abs(y - order**2 * z) > ROUNDING * y, y - order**2 * z, 0.0)
    squares = [float(s) for s in z[gap == 0]]
    for k in np.flatnonzero(gap[:-1] * gap[1:] < 0):
        squares.append(brentq(lambda s: float(curve(s)) - order**2 * s, z[k], z[k + 1]))  # type: ignore[operator]
    return [Crossing(branch, order, math.sqrt(s), order * math.sqrt(s) / (2 * math.pi)) for s in squares]
