"""Properties and materials of a deck by number, each read once; its errors are reported once, where it stands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card

T = TypeVar("T")
MAX_SHOWN = 12  # maximum number of known numbers in an error


class ByNumber(Generic[T]):
    """Values by number; None for a card with an error, which is already reported.

    kind   "property" or "material"
    among  what the known ones are, such as "of shells it has"
    """

    def __init__(self, bulk: Bulk, kind: str, among: str) -> None:
        self._bulk, self._kind, self._among = bulk, kind, among
        self._values: dict[int, T | None] = {}
        self._cards: dict[int, Card] = {}

    def read_cards(self, name: str, reader: Callable[[Card], T], use: bool = True) -> None:
        """Read all cards of this name; a number may be repeated with the same fields alone."""
        self._bulk.for_each_card(lambda card: self._add(card, reader), name, use=use)

    def _add(self, card: Card, reader: Callable[[Card], T]) -> None:
        number = card.integer(0)
        if number in self._cards and self._values[number] is not None:
            first = self._cards[number]
            if first.fields != card.fields:
                raise ValueError(f"{card} gives {self._kind} {number} again, which stands at {first.location} already")
            return
        self._cards[number], self._values[number] = card, None
        self._values[number] = reader(card)

    def __contains__(self, number: object) -> bool:
        return number in self._values

    def __call__(self, number: int) -> T | None:
        """The value with this number; None if its card has an error. Raises ValueError if the deck has none."""
        if number not in self._values:
            numbers = ", ".join(map(str, sorted(self._values)[:MAX_SHOWN])) or "none"
            raise ValueError(f"names {self._kind} {number}, which is not in the deck; {self._among} {numbers}")
        return self._values[number]

    def values(self) -> list[T]:
        """The values without errors, in order of their cards."""
        return [value for value in self._values.values() if value is not None]
