"""Coordinate systems: CORD1R, CORD1C, CORD1S, CORD2R, CORD2C, CORD2S, also relative to each other, in SI."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.decks.axes import Axes
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card


class System(Axes):
    """A coordinate system, in which positions are given too."""

    def position(self, coordinates: ArrayLike, length: float) -> Array:
        """Basic position (3,) [m] of coordinates in units of `length`, angles in degrees."""
        a, b, c = (float(value) for value in np.asarray(coordinates, float))
        if self.kind == "C":
            t = np.radians(b)
            local = np.array([a * np.cos(t), a * np.sin(t), c])
        elif self.kind == "S":
            t, p = np.radians(b), np.radians(c)
            local = a * np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
        else:
            local = np.array([a, b, c])
        return self.origin + length * local @ self.C


BASIC = System("R", np.zeros(3), np.eye(3))


class Systems:
    """All systems of a deck, built on first use; systems defined by grids need `grid_position`."""

    def __init__(self, bulk: Bulk) -> None:
        self._bulk = bulk
        self._by_number: dict[int, System] = {0: BASIC}
        self._cards: dict[int, tuple[Card, int]] = {}  # number -> card and the first of its fields
        self._in_progress: list[int] = []
        self.grid_position: Callable[[int], Array] = lambda number: np.zeros(3)
        for kind in "RCS":
            bulk.for_each_card(self._add_by_points, f"CORD2{kind}")
            bulk.for_each_card(self._add_by_grids, f"CORD1{kind}")

    def _add_by_points(self, card: Card) -> None:
        self._register(card.integer(0), card, 0)

    def _add_by_grids(self, card: Card) -> None:
        for start in (0, 4):
            if card.has(start):
                self._register(card.integer(start), card, start)

    def _register(self, number: int, card: Card, start: int) -> None:
        if number in self._cards and self._cards[number][0].fields != card.fields:
            first = self._cards[number][0]
            raise ValueError(f"{card} gives coordinate system {number} again, which stands at {first.location} already")
        self._cards[number] = (card, start)

    def __call__(self, number: int) -> System:
        """The system with this number. Raises ValueError if the deck has none, or for circular definitions."""
        if number in self._by_number:
            return self._by_number[number]
        if number not in self._cards:
            numbers = ", ".join(map(str, sorted(self._cards)[:12])) or "none"
            raise ValueError(f"coordinate system {number} is not in the deck, which has {numbers}")
        if number in self._in_progress:
            raise ValueError(
                f"coordinate systems {sorted(set(self._in_progress))} refer to each other in a cycle; define one of "
                "them in the basic system"
            )
        self._in_progress.append(number)
        try:
            self._by_number[number] = self._defined_system(*self._cards[number])
        finally:
            self._in_progress.pop()
        return self._by_number[number]

    def _defined_system(self, card: Card, start: int) -> System:
        if card.name[4] == "1":
            A, B, C = (self.grid_position(card.integer(start + k)) for k in (1, 2, 3))
        else:
            reference = self(card.integer(1, 0))
            A, B, C = (reference.position(card.reals(first, 3), self._bulk.units.length) for first in (2, 5, 8))
        z, size = B - A, np.linalg.norm(B - A)
        if size == 0:
            raise ValueError(f"{card} has its z axis between two equal points")
        z = z / size
        x = (C - A) - ((C - A) @ z) * z
        if np.linalg.norm(x) <= 1e-9 * np.linalg.norm(C - A):
            raise ValueError(f"{card} has its third point on its z axis; it must lie in the x-z plane, off the axis")
        x = x / np.linalg.norm(x)
        return System(card.name[5], A, np.stack([x, np.cross(z, x), z]))
