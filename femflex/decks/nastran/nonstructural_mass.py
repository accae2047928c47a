"""Nonstructural mass from separate cards: NSM1 of the set that case control selects."""

from __future__ import annotations

from typing import NamedTuple

from femflex.decks.findings import BY_MATRICES
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card, FieldError, numbers_of
from femflex.decks.nastran.shell_properties import KINDS as SHELLS

AREA_PROPERTIES = ("PSHELL", "PCOMP", "PCOMPG", "PSHEAR")
LINE_PROPERTIES = ("PBAR", "PBARL", "PBEAM", "PBEAML", "PBCOMP", "PROD", "PTUBE")
KINDS = ("ELEMENT", "ELSET", "CONROD", *AREA_PROPERTIES, *LINE_PROPERTIES)
CARDS = ("NSM", "NSM1", "NSML", "NSML1", "NSMADD")  # of which NSM1 is read


class _Element(NamedTuple):
    """The card of an element that takes nonstructural mass, and its property, 0 of a CONROD."""

    card: str
    pid: int


class NonstructuralMass:
    """Mass per area [kg/m^2] or per length [kg/m] that NSM1 cards add to elements, by element number."""

    def __init__(self, bulk: Bulk) -> None:
        self._bulk = bulk
        self._added: dict[int, float] = {}
        cards = [card for name in CARDS for card in bulk.cards_named(name, use=False)]
        defined = {card.integer(0) for card in cards if card.is_integer(0)}
        selected = bulk.selected("NSM", defined)
        if cards and selected is not None and selected not in defined:
            bulk.findings.note(f"NSM set {selected} is in force, and the deck has no card of it; it adds no mass")
        takers = (*SHELLS, "CBAR", "CBEAM", "CROD", "CTUBE", "CONROD") if cards else ()
        self._elements = {
            card.integer(0): _Element(name, 0 if name == "CONROD" else int(card.word(1, card.word(0))))
            for name in takers for card in bulk.cards_named(name, use=False) if card.is_integer(0)
        }  # fmt: skip
        for card in cards:
            if card.is_integer(0) and card.integer(0) != selected:
                text = f"of set {card.integer(0)}, which case control does not select"
                bulk.findings.unused(card.name, text, card.location)
                continue
            bulk.findings.use(card.name)
            bulk.attempt(card, lambda card=card: self._add(card))  # type: ignore[misc]
        if self._added:
            bulk.findings.note(f"NSM1 cards add nonstructural mass to {len(self._added)} elements")

    def __call__(self, number: int) -> float:
        """Mass that the cards add to an element, [kg/m^2] or [kg/m]; 0 if they do not name it."""
        return self._added.get(number, 0.0)

    def _add(self, card: Card) -> None:
        """NSM1: SID, TYPE, VALUE, then numbers of elements, sets or properties, or ALL."""
        if card.name != "NSM1" or "DISTR" in card.words_from(3):
            what = "is in force" if card.name != "NSM1" else "has DISTR, by volume or mass"
            raise ValueError(
                f"{card} {what}, and NSM1 without DISTR alone is read; give its masses by NSM1 of set {card.word(0)}, "
                f"or {BY_MATRICES}"
            )
        value = card.real(2) * self._bulk.units.mass * self._bulk.wtmass
        for number in self._listed_elements(card, card.word(1)):
            has_area = self._elements[number].card in SHELLS
            added = value / self._bulk.units.length ** (2 if has_area else 1)
            self._added[number] = self._added.get(number, 0.0) + added
            if has_area and self._added[number] < 0:
                raise ValueError(f"{card} makes the nonstructural mass of element {number} negative; correct it")

    def _listed_elements(self, card: Card, kind: str) -> list[int]:
        """Numbers of the elements that a card lists: by themselves, by sets of case control, or by properties."""
        if kind not in KINDS:
            raise FieldError(f"{card} has {kind!r} in field 3; nonstructural mass is read of {', '.join(KINDS)}")
        fitting = {n: element for n, element in self._elements.items() if _fits(kind, element)}
        if card.word(3) == "ALL":
            return list(fitting)
        sets = self._bulk.sets
        known = {"ELSET": {*sets}, "ELEMENT": {*fitting}, "CONROD": {*fitting}}.get(
            kind, {e.pid for e in fitting.values()}
        )
        listed = numbers_of(card, 3, known)
        unknown = (
            set(listed) - known if "THRU" not in card.words_from(3) else set()
        )  # the ends of a range need not exist
        if kind == "ELSET":
            numbers = [n for key in listed if key in known for n in sets[key].among(fitting)]
        elif kind in ("ELEMENT", "CONROD"):
            numbers = [n for n in listed if n in known]
        else:
            numbers = [n for n, element in fitting.items() if element.pid in listed]
        if unknown or not numbers:
            number = min(unknown, default=card.word(3))
            raise ValueError(f"{card} names {number}, of which the deck has no element that takes such mass")
        return list(dict.fromkeys(numbers))


def _fits(kind: str, element: _Element) -> bool:
    """Whether an element is of the kind that a card names."""
    if kind == "CONROD" or (element.card == "CONROD" and kind not in ("ELEMENT", "ELSET")):
        return kind == element.card
    return kind in ("ELEMENT", "ELSET") or (element.card in SHELLS) == (kind in AREA_PROPERTIES)
