"""Line elements of three nodes, curved where the middle one lies off the chord, as chains of straight elements."""

from __future__ import annotations

import numpy as np

from femflex.decks.builder import Builder

HALF = 4  # straight elements between the middle and an end; the arc's length is off by (angle / 8)^2 / 24
STRAIGHT = 1e-3  # of the length: distance of the middle from that of the chord that lengthens it by less than 1e-6


def chain_of(build: Builder, start: int, middle: int, end: int) -> list[int]:
    """Rows of the points along an element: its own three, and new ones on their parabola if it is curved."""
    a, c, b = (build.points[row] for row in (start, middle, end))
    if np.linalg.norm(c - (a + b) / 2) <= STRAIGHT * np.linalg.norm(b - a):
        return [start, middle, end]
    at = np.linspace(-1, 1, 2 * HALF + 1)
    x = np.stack([at * (at - 1) / 2, 1 - at**2, at * (at + 1) / 2], axis=1) @ np.stack([a, c, b])
    inner = [build.point(x[k]) for k in range(1, 2 * HALF) if k != HALF]
    return [start, *inner[: HALF - 1], middle, *inner[HALF - 1 :], end]
