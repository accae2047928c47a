"""The cards of a deck by kind, with case control and parameters; errors of cards are collected."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from femflex.decks.findings import Findings, Location, Overrides
from femflex.decks.nastran.card import Card, FieldError
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
    solution: str = ""
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
        except FieldError as error:
            self.findings.problem(str(error), card.location)
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
    for card in [*bulk.cards.get("PARAM", ()), *_control_parameters(raw)]:  # case control takes precedence
        bulk.parameters[card.word(0)] = card
    if (wtmass := bulk.parameters.get("WTMASS")) is not None:
        bulk.attempt(wtmass, lambda: setattr(bulk, "wtmass", wtmass.real(1)))
    _read_selections(bulk)
    return bulk


def _control_parameters(raw: RawDeck) -> list[Card]:
    """PARAM of case control as cards: those above the subcases and in the first one."""
    cards, subcases = list[Card](), 0
    for line in raw.control:
        text = line.text.strip().upper()
        subcases += bool(re.match(r"(SUBCASE|STEP)\b", text))
        words = [word for word in re.split(r"[\s,=]+", text) if word]
        if subcases < 2 and len(words) > 2 and words[0] == "PARAM":
            cards.append(Card("PARAM", words[1:], Location(line.file, line.number)))
    return cards


def _read_selections(bulk: Bulk) -> None:
    """Read the selections of case control: above the subcases, replaced by those of the first subcase."""
    above: dict[str, int] = {}
    subcases: list[dict[str, int]] = []
    for line in bulk.raw.control:
        text = line.text.strip().upper()
        if re.match(r"SOL\b", text):
            bulk.solution = text[3:].strip(" ,=")
        if re.match(r"(SUBCASE|STEP)\b", text):
            subcases.append({})
            continue
        match = re.match(r"(SPC|MPC|METHOD|NSM)\s*[= ]\s*(\d+)", text)
        if match:
            (subcases[-1] if subcases else above)[match[1]] = int(match[2])
    first = subcases[0] if subcases else {}
    bulk.selected_sets = {**first, **above} if not first else {**above, **first}
    for key in ("SPC", "MPC", "NSM"):
        others = {subcase[key] for subcase in subcases[1:] if key in subcase} - {bulk.selected_sets.get(key)}
        if others:
            bulk.findings.note(
                f"the subcases name several sets of {key} ({bulk.selected_sets.get(key, 'none')} in the first, then "
                f"{', '.join(map(str, sorted(o for o in others if o is not None)))}); that of the first is used"
            )
