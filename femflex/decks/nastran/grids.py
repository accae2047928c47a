"""Grid points: GRID with its systems CP and CD and GRDSET."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from femflex.arrays import Array
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.systems import Systems


@dataclass(frozen=True, eq=False)
class Grid:
    """A grid point: its basic position (3,) [m], number of its displacement system, and components fixed on the
    card."""

    position: Array
    displacement: int
    fixed: tuple[int, ...]
    card: Card


class Grids:
    """The grid points of a deck by number."""

    def __init__(self, bulk: Bulk, systems: Systems) -> None:
        self._bulk, self.systems = bulk, systems
        self._cards: dict[int, Card] = {}
        self._grids: dict[int, Grid] = {}
        self._defaults = next(iter(bulk.cards_named("GRDSET")), None)
        systems.grid_position = self.position
        bulk.for_each_card(self._add, "GRID")
        for number, card in self._cards.items():
            bulk.attempt(card, lambda number=number: self._grid(number))  # type: ignore[misc]

    def _add(self, card: Card) -> None:
        number = card.integer(0)
        if number in self._cards:
            first = self._cards[number]
            is_repetition = [w or "0" for w in first.fields[:6]] == [w or "0" for w in card.fields[:6]]
            if not is_repetition:
                raise ValueError(f"{card} is given again with other values; it stands at {first.location} already")
            return
        self._cards[number] = card

    def _grid(self, number: int) -> Grid:
        if number in self._grids:
            return self._grids[number]
        card, default = self._cards[number], self._defaults
        cp = card.integer(1, default.integer(1, 0) if default else 0)
        cd = card.integer(5, default.integer(5, 0) if default else 0)
        fixed = card.components(6, default.word(6) if default else "")
        coordinates = card.reals(2, 3)
        if not all(math.isfinite(value) for value in coordinates):
            raise ValueError(f"{card} has coordinates that are not finite")
        if cd > 0:
            self.systems(cd)
        if cd < 0:
            self._bulk.findings.unused(
                "GRID", "fluid points (CD = -1) are left out; the mass of the fluid is missing", card.location
            )
        self._grids[number] = Grid(self.systems(cp).position(coordinates, self._bulk.units.length), cd, fixed, card)
        return self._grids[number]

    def __contains__(self, number: object) -> bool:
        return number in self._cards

    def __len__(self) -> int:
        return len(self._cards)

    def __iter__(self) -> Iterator[int]:
        return iter(self._cards)

    def numbers(self) -> list[int]:
        """Numbers of all grid points, in the order of their cards."""
        return list(self._grids)

    def __getitem__(self, number: int) -> Grid:
        return self._grids[number]

    def position(self, number: int) -> Array:
        """Basic position (3,) [m]. Raises ValueError if the deck has no such grid point."""
        if number not in self._cards:
            raise ValueError(f"grid point {number} is not in the deck")
        return self._grid(number).position

    def axes(self, number: int) -> Array:
        """Directions (3, 3) of the displacement system at a grid point, as rows."""
        grid = self._grids[number]
        return self.systems(max(grid.displacement, 0)).axes_at(grid.position)

    def require(self, numbers: list[int], card: Card) -> bool:
        """Whether all numbers are usable grid points; adds a problem for unknown ones."""
        missing = [number for number in numbers if number not in self._grids]
        unknown = [number for number in missing if number not in self._cards]
        if unknown:
            numbers_text = ", ".join(map(str, unknown[:5]))
            self._bulk.findings.problem(
                f"{card} uses grid point {numbers_text}, which no GRID card defines", card.location
            )
        return not missing
