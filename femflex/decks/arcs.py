"""Three-node line elements, curved if the middle node lies off the chord, as chains of straight elements."""

from __future__ import annotations

import numpy as np

from femflex.decks.builder import Builder

ELEMENTS_PER_HALF = (
    4  # straight elements between the middle and an end; relative error of the arc length (angle / 8)^2 / 24
)
STRAIGHT = 1e-3  # of the length: offset of the middle node up to which the element is straight (lengthens it by 1e-6)


def chain_of(build: Builder, start: int, middle: int, end: int) -> list[int]:
    """Rows of the points along an element: its three nodes, and new points on their parabola if it is curved."""
    a, c, b = (build.points[row] for row in (start, middle, end))
    if np.linalg.norm(c - (a + b) / 2) <= STRAIGHT * np.linalg.norm(b - a):
        return [start, middle, end]
    xi = np.linspace(-1, 1, 2 * ELEMENTS_PER_HALF + 1)
    x = np.stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2], axis=1) @ np.stack([a, c, b])
    inner = [build.point(x[k]) for k in range(1, 2 * ELEMENTS_PER_HALF) if k != ELEMENTS_PER_HALF]
    return [start, *inner[: ELEMENTS_PER_HALF - 1], middle, *inner[ELEMENTS_PER_HALF - 1 :], end]
