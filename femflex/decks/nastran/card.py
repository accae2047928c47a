"""A card of bulk data with its fields as numbers and words; a wrong field raises FieldError with its position and
value."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from femflex.decks.findings import Location
from femflex.mesh.formats.guards import check_count
from femflex.mesh.formats.nastran_cards import read_number_list, real
from femflex.mesh.formats.numbers import Numbers


class FieldError(ValueError):
    """A field of a card that cannot be read."""


@dataclass(frozen=True, eq=False)
class Card:
    """A card by name, with its data fields (the first is field 2 of the card) and its location."""

    name: str
    fields: list[str]
    location: Location

    def __str__(self) -> str:
        return f"{self.name} {self.fields[0]}" if self.fields and self.fields[0] else self.name

    def word(self, k: int, default: str = "") -> str:
        """Field k as a word in capitals; the default where it is blank."""
        return (self.fields[k].strip().upper() if k < len(self.fields) else "") or default

    def has(self, k: int) -> bool:
        """Whether field k is filled."""
        return self.word(k) != ""

    def integer(self, k: int, default: int | None = None) -> int:
        """Field k as a whole number; the default where it is blank. Raises FieldError."""
        word = self.word(k)
        if not word:
            if default is None:
                raise FieldError(f"{self} has nothing in field {k + 2}, where a whole number is needed")
            return default
        if not re.fullmatch(r"[+-]?\d+", word):
            raise FieldError(f"{self} has {word!r} in field {k + 2}, where a whole number is needed")
        return int(word)

    def real(self, k: int, default: float | None = None) -> float:
        """Field k as a number, in any of Nastran's formats (1.5-3, 2.D+4); the default where blank. Raises
        FieldError."""
        word = self.word(k).replace(" ", "")  # 2.0 E+7
        if not word:
            if default is None:
                raise FieldError(f"{self} has nothing in field {k + 2}, where a number is needed")
            return default
        try:
            return real(word)
        except ValueError:
            raise FieldError(f"{self} has {word!r} in field {k + 2}, where a number is needed") from None

    def reals(self, start: int, count: int) -> list[float]:
        """Fields start to start + count - 1 as numbers, blank ones zero."""
        return [self.real(k, 0.0) for k in range(start, start + count)]

    def pairs(self, *starts: int) -> dict[int, float]:
        """Value by number, from the pairs of fields that begin at these fields and are filled."""
        return {self.integer(k): self.real(k + 1, 0.0) for k in starts if self.has(k)}

    def is_integer(self, k: int) -> bool:
        """Whether field k is a whole number."""
        return re.fullmatch(r"[+-]?\d+", self.word(k)) is not None

    def components(self, k: int, default: str = "") -> tuple[int, ...]:
        """Field k as components 1 to 6, such as 12346; 0 and blank name none. Raises FieldError."""
        word = self.word(k, default).replace(" ", "")
        if not re.fullmatch(r"[0-6]*", word):
            raise FieldError(f"{self} has {word!r} in field {k + 2}, where components 1 to 6 are needed")
        return tuple(sorted({int(c) for c in word if c != "0"}))

    def words_from(self, start: int) -> list[str]:
        """The filled fields from `start` on, in capitals."""
        return [word.strip().upper() for word in self.fields[start:] if word.strip()]


def numbers_of(card: Card, start: int, allowed: Collection[int] | None = None) -> list[int]:
    """The whole numbers listed from a field on, with THRU, BY and EXCEPT. Raises FieldError.

    allowed: a dict or a set to which ranges are limited; None: every number of a range.
    """
    try:
        listed = read_number_list(card.words_from(start))
    except ValueError as error:
        raise FieldError(f"{card}: {error}") from None
    numbers = list[int]()
    for part in listed.parts:
        if isinstance(part, int):
            numbers.append(part)
            continue
        if allowed is None:
            check_count(len(part), str(card))
        numbers += part if allowed is None else Numbers((part,)).among(allowed)
    excluded = set(listed.without.among(numbers)) if listed.without is not None else set[int]()
    return [number for number in numbers if number not in excluded]
