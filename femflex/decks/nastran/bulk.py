"""The cards of a deck by kind, with case control and parameters; errors of cards are collected."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from femflex.decks.findings import BY_MATRICES, Findings, Location, Overrides
from femflex.decks.nastran.card import Card
from femflex.decks.units import Units
from femflex.mesh.formats.nastran_cards import Deck as RawDeck
from femflex.mesh.formats.numbers import Numbers


@dataclass
class Bulk:
    """Cards by kind, selections of case control, and findings.

    selected_sets  SPC, MPC, ... of case control -> number; above the subcases, or of the first subcase
    wtmass         PARAM,WTMASS: factor of all masses
    """

    raw: RawDeck
    units: Units
    override: Overrides
    findings: Findings = field(default_factory=Findings)
    cards: dict[str, list[Card]] = field(default_factory=dict)
    selected_sets: dict[str, int] = field(default_factory=dict)
    parameters: dict[str, Card] = field(default_factory=dict)
    wtmass: float = 1.0

    @property
    def sets(self) -> Mapping[int, Numbers]:
        """SETs of case control."""
        return self.raw.sets

    def names_of(self, number: int) -> list[str]:
        """The name of a property in comments, if any."""
        name = self.raw.property_names.get(number, "")
        return [name] if name else []

    def cards_named(self, *names: str, use: bool = True) -> Iterator[Card]:
        """Cards of these names, in order, counted as used."""
        for name in names:
            for card in self.cards.get(name, ()):
                if use:
                    self.findings.use(name)
                yield card

    def for_each_card(self, action: Callable[[Card], object], *names: str, use: bool = True) -> None:
        """Call the action for each card of these names; a ValueError becomes a problem at the card's location."""
        for card in self.cards_named(*names, use=use):
            self.attempt(card, lambda card=card: action(card))  # type: ignore[misc]

    def attempt(self, card: Card, action: Callable[[], object]) -> None:
        """Call the action for a card; a ValueError becomes a problem at the card's location."""
        try:
            action()
        except ValueError as error:
            text = str(error)
            if text.startswith(f"{card} names "):  # the same text for many cards
                text = text.removeprefix(f"{card} ")
            if str(card) in text:
                self.findings.problem(text, card.location)
            else:
                self.findings.problem(text, card.location, str(card))

    def selected(self, kind: str, defined: set[int]) -> int | None:
        """The set of this kind that case control selects, or the only one of a deck without case control, with a
        note."""
        number = self.selected_sets.get(kind)
        if number is None and len(defined) == 1 and not self.raw.control:
            (number,) = defined
            self.findings.note(f"no case control names a set of {kind}; the only one, {number}, is used")
        return number


def bulk_of(raw: RawDeck, units: Units, override: Overrides) -> Bulk:
    """The Bulk of a deck's raw cards."""
    bulk = Bulk(raw, units, override)
    for raw_card in raw.raw:
        name = raw_card.name.upper()
        bulk.cards.setdefault(name, []).append(Card(name, raw_card.fields, Location(raw_card.file, raw_card.line)))
    bulk.parameters = {card.word(0): card for card in bulk.cards.get("PARAM", ())}
    _read_control(bulk)
    if (wtmass := bulk.parameters.get("WTMASS")) is not None:
        bulk.attempt(wtmass, lambda: setattr(bulk, "wtmass", wtmass.real(1)))
    return bulk


def _read_control(bulk: Bulk) -> None:
    """Read the selections of case control, and its PARAMs, which take precedence over bulk data: those above the
    subcases, replaced by those of the first subcase."""
    above: dict[str, int] = {}
    subcases: list[dict[str, int]] = []
    for line in bulk.raw.control:
        text = line.text.strip().upper()
        words = [word for word in re.split(r"[\s,=]+", text) if word]
        if re.match(r"(SUBCASE|STEP)\b", text):
            subcases.append({})
        elif match := re.match(r"(SPC|MPC|NSM)\s*[= ]\s*(\d+)", text):
            (subcases[-1] if subcases else above)[match[1]] = int(match[2])
        elif len(subcases) < 2 and len(words) > 2 and words[0] == "PARAM":
            bulk.parameters[words[1]] = Card("PARAM", words[1:], Location(line.file, line.number))
    bulk.selected_sets = {**above, **(subcases[0] if subcases else {})}
    for key in ("SPC", "MPC", "NSM"):
        others = {subcase[key] for subcase in subcases[1:] if key in subcase} - {bulk.selected_sets.get(key)}
        if others:
            bulk.findings.note(
                f"the subcases name several sets of {key} ({bulk.selected_sets.get(key, 'none')} in the first, then "
                f"{', '.join(map(str, sorted(o for o in others if o is not None)))}); that of the first is used"
            )


T = TypeVar("T")
MAX_SHOWN = 12  # maximum number of known numbers in an error


class ByNumber(Generic[T]):
    """Values by number; None for a card with an error, which is already reported.

    kind   "property" or "material"
    among  what the known ones are, such as "of shells it has"
    unread, instead  cards of the same kind that are not read, and those that may take their place
    """

    def __init__(self, bulk: Bulk, kind: str, among: str, unread: tuple[str, ...] = (), instead: str = "") -> None:
        self._bulk, self._kind, self._among, self._instead = bulk, kind, among, instead
        others = bulk.cards_named(*unread, use=False)
        self._unread = {card.integer(0): card for card in others if card.is_integer(0)}
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

    def __call__(self, number: int) -> T | None:
        """The value with this number; None if its card has an error. Raises ValueError if the deck has none."""
        if number not in self._values and number in self._unread:
            raise ValueError(
                f"names {self._unread[number]}, which is not understood; give {self._instead} instead, or {BY_MATRICES}"
            )
        if number not in self._values:
            numbers = ", ".join(map(str, sorted(self._values)[:MAX_SHOWN])) or "none"
            raise ValueError(f"names {self._kind} {number}, which is not in the deck; {self._among} {numbers}")
        return self._values[number]

    def values(self) -> list[T]:
        """The values without errors, in order of their cards."""
        return [value for value in self._values.values() if value is not None]
