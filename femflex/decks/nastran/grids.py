"""Grid points: GRID with its systems CP and CD, GRDSET, and scalar points."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from femflex.arrays import Array
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card, numbers_of
from femflex.decks.nastran.systems import Systems


@dataclass(frozen=True, eq=False)
class Grid:
    """A grid point: its basic position (3,) [m], number of its displacement system, and components held on the card."""

    position: Array
    displacement: int
    held: tuple[int, ...]
    card: Card


class Grids:
    """The grid points of a deck by number."""

    def __init__(self, bulk: Bulk, systems: Systems) -> None:
        self._bulk, self.systems = bulk, systems
        self._cards: dict[int, Card] = {}
        self._made: dict[int, Grid] = {}
        self._defaults = next(iter(bulk.each("GRDSET")), None)
        self.scalars: set[int] = set()
        systems.grid_position = self.position
        bulk.trying(self._add, "GRID")
        for card in bulk.each("SPOINT", use=False):
            bulk.attempt(card, lambda card=card: self.scalars.update(numbers_of(card, 0)))  # type: ignore[misc]
        for number, card in self._cards.items():
            bulk.attempt(card, lambda number=number: self._make(number))  # type: ignore[misc]

    def _add(self, card: Card) -> None:
        number = card.integer(0)
        if number in self._cards:
            first = self._cards[number]
            same = [w or "0" for w in first.fields[:6]] == [w or "0" for w in card.fields[:6]]
            if not same:
                raise ValueError(f"{card} is given again with other values; it stands at {first.place} already")
            return
        self._cards[number] = card

    def _make(self, number: int) -> Grid:
        if number in self._made:
            return self._made[number]
        card, default = self._cards[number], self._defaults
        cp = card.integer(1, default.integer(1, 0) if default else 0)
        cd = card.integer(5, default.integer(5, 0) if default else 0)
        held = card.components(6, default.word(6) if default else "")
        given = card.reals(2, 3)
        if not all(math.isfinite(value) for value in given):
            raise ValueError(f"{card} has coordinates that are not finite")
        if cd > 0:
            self.systems(cd)
        if cd < 0:
            self._bulk.found.unused(
                "GRID", "fluid points (CD = -1) are left out; the mass of the fluid is missing", card.place
            )
        self._made[number] = Grid(self.systems(cp).position(given, self._bulk.units.length), cd, held, card)
        return self._made[number]

    def __contains__(self, number: object) -> bool:
        return number in self._cards

    def __len__(self) -> int:
        return len(self._cards)

    def __iter__(self) -> Iterator[int]:
        return iter(self._cards)

    def numbers(self) -> list[int]:
        """Numbers of all grid points, in the order of their cards."""
        return list(self._made)

    def __getitem__(self, number: int) -> Grid:
        return self._made[number]

    def position(self, number: int) -> Array:
        """Basic position (3,) [m]. Raises ValueError where the deck has no such grid point."""
        if number not in self._cards:
            raise ValueError(f"grid point {number} is not in the deck")
        return self._make(number).position

    def axes(self, number: int) -> Array:
        """Directions (3, 3) of the displacement system at a grid point, as rows."""
        grid = self._made[number]
        return self.systems(max(grid.displacement, 0)).axes_at(grid.position)

    def require(self, numbers: list[int], card: Card) -> bool:
        """Whether all of these are grid points; a problem where not."""
        missing = [number for number in numbers if number not in self._made]
        unknown = [number for number in missing if number not in self._cards]
        if unknown:
            what = "scalar points" if all(n in self.scalars for n in unknown) else "no GRID card defines"
            named = ", ".join(map(str, unknown[:5]))
            text = f"uses {named}, {what}" if "scalar" in what else f"uses grid point {named}, which {what}"
            self._bulk.found.problem(f"{card} {text}", card.place)
        return not missing
