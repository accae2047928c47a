"""The cards of a deck by kind, with case control and parameters; whatever is wrong with a card is collected."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from femflex.decks.findings import Findings, Place
from femflex.decks.nastran.card import Card, FieldError
from femflex.decks.units import Units
from femflex.mesh.nastran_cards import Deck as RawDeck
from femflex.mesh.numbers import Numbers

COMMAND = re.compile(r"\s*([A-Z]+)\s*(?:\([^)]*\))?\s*[= ]\s*(.*?)\s*$", re.I)


@dataclass
class Bulk:
    """Cards by kind, what case control chooses, and what is found wrong.

    chosen    SPC, MPC, ... of case control -> number; those above the subcases, else of the first subcase
    wtmass    PARAM,WTMASS: factor of all masses
    """

    raw: RawDeck
    units: Units
    overrides: Mapping[str, Mapping[str, Any]]
    found: Findings = field(default_factory=Findings)
    cards: dict[str, list[Card]] = field(default_factory=dict)
    chosen: dict[str, int] = field(default_factory=dict)
    parameters: dict[str, Card] = field(default_factory=dict)
    solution: str = ""
    wtmass: float = 1.0
    taken: set[str] = field(default_factory=set)  # overrides that were found

    @property
    def sets(self) -> Mapping[int, Numbers]:
        """SETs of case control."""
        return self.raw.sets

    def names_of(self, number: int) -> list[str]:
        """The name that comments give a property, if any."""
        name = self.raw.property_names.get(number, "")
        return [name] if name else []

    def each(self, *names: str, use: bool = True) -> Iterator[Card]:
        """Cards of these names, in order, counted as used."""
        for name in names:
            for card in self.cards.get(name, ()):
                if use:
                    self.found.use(name)
                yield card

    def trying(self, action: Callable[[Card], object], *names: str, use: bool = True) -> None:
        """Do something with each card of these names; a ValueError becomes a problem at the card's place."""
        for card in self.each(*names, use=use):
            self.attempt(card, lambda card=card: action(card))  # type: ignore[misc]

    def attempt(self, card: Card, action: Callable[[], object]) -> None:
        """Do something for a card; a ValueError becomes a problem at the card's place."""
        try:
            action()
        except FieldError as error:
            self.found.problem(str(error), card.place)
        except ValueError as error:
            text = str(error)
            if text.startswith(f"{card} names "):  # said alike by many cards
                text = text.removeprefix(f"{card} ")
            if str(card) in text:
                self.found.problem(text, card.place)
            else:
                self.found.problem(text, card.place, str(card))

    def override(self, names: list[str], values: dict[str, float], where: str) -> dict[str, float]:
        """Values with those replaced that overrides name by any of the names; ValueError on unknown keys."""
        found = dict(values)
        for name in names:
            for key, value in self.overrides.get(name, {}).items():
                self.taken.add(name)
                if key not in found:
                    raise ValueError(f"{where}: override of {name} names {key!r}; it has {sorted(found)}")
                found[key] = float(value)
        return found


def bulk_of(raw: RawDeck, units: Units, overrides: Mapping[str, Mapping[str, Any]]) -> Bulk:
    """The Bulk of a deck's raw cards."""
    bulk = Bulk(raw, units, overrides)
    for one in raw.raw:
        name = one.name.upper()
        bulk.cards.setdefault(name, []).append(Card(name, one.fields, Place(one.file, one.line)))
    for card in [*bulk.cards.get("PARAM", ()), *_control_parameters(raw)]:  # case control's have the last word
        bulk.parameters[card.word(0)] = card
    if (wtmass := bulk.parameters.get("WTMASS")) is not None:
        bulk.attempt(wtmass, lambda: setattr(bulk, "wtmass", wtmass.real(1)))
    _control(bulk)
    return bulk


def _control_parameters(raw: RawDeck) -> list[Card]:
    """PARAM of case control as cards: those above the subcases and of the first."""
    found, subcases = list[Card](), 0
    for line in raw.control:
        text = line.text.strip().upper()
        subcases += bool(re.match(r"(SUBCASE|STEP)\b", text))
        words = [word for word in re.split(r"[\s,=]+", text) if word]
        if subcases < 2 and len(words) > 2 and words[0] == "PARAM":
            found.append(Card("PARAM", words[1:], Place(line.file, line.number)))
    return found


def _control(bulk: Bulk) -> None:
    """Take the choices of case control: those above the subcases first, then those of the first subcase."""
    above: dict[str, int] = {}
    subcases: list[dict[str, int]] = []
    for line in bulk.raw.control:
        text = line.text.strip().upper()
        if re.match(r"SOL\b", text):
            bulk.solution = text[3:].strip(" ,=")
        if re.match(r"(SUBCASE|STEP)\b", text):
            subcases.append({})
            continue
        found = re.match(r"(SPC|MPC|METHOD|NSM)\s*[= ]\s*(\d+)", text)
        if found:
            (subcases[-1] if subcases else above)[found[1]] = int(found[2])
    first = subcases[0] if subcases else {}
    bulk.chosen = {**first, **above} if not first else {**above, **first}
    for key in ("SPC", "MPC", "NSM"):
        others = {one[key] for one in subcases[1:] if key in one} - {bulk.chosen.get(key)}
        if others:
            bulk.found.note(
                f"the subcases name several sets of {key} ({bulk.chosen.get(key, 'none')} in the first, then "
                f"{', '.join(map(str, sorted(o for o in others if o is not None)))}); that of the first is used"
            )
