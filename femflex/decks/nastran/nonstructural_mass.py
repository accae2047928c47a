"""Nonstructural mass from separate cards: NSM1 of the set that case control selects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from femflex.decks.findings import BY_MATRICES
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card, FieldError, numbers_of
from femflex.decks.nastran.shell_properties import KINDS as SHELLS

LINE_CARDS = ("CBAR", "CBEAM", "CROD", "CTUBE", "CONROD")  # per length
AREA_PROPERTIES = ("PSHELL", "PCOMP", "PCOMPG", "PSHEAR")
LINE_PROPERTIES = ("PBAR", "PBARL", "PBEAM", "PBEAML", "PBCOMP", "PROD", "PTUBE")
KINDS = ("ELEMENT", "ELSET", "CONROD", *AREA_PROPERTIES, *LINE_PROPERTIES)
CARDS = ("NSM", "NSM1", "NSML", "NSML1", "NSMADD")  # of which NSM1 is read


@dataclass(frozen=True)
class _Element:
    """An element that takes nonstructural mass: its number and property, its card, and whether it has an area."""

    number: int
    pid: int
    card: str
    has_area: bool


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
        self._elements = {element.number: element for element in self._all_elements()} if cards else {}
        for card in cards:
            if card.is_integer(0) and card.integer(0) != selected:
                bulk.findings.unused(
                    card.name, f"of set {card.integer(0)}, which case control does not select", card.location
                )
                continue
            bulk.findings.use(card.name)
            bulk.attempt(card, lambda card=card: self._add(card))  # type: ignore[misc]
        if self._added:
            bulk.findings.note(f"NSM1 cards add nonstructural mass to {len(self._added)} elements")

    def __call__(self, number: int) -> float:
        """Mass that the cards add to an element, [kg/m^2] or [kg/m]; 0 if they do not name it."""
        return self._added.get(number, 0.0)

    def _all_elements(self) -> Iterator[_Element]:
        """The elements of the deck that take nonstructural mass."""
        for name in (*SHELLS, *LINE_CARDS):
            for card in self._bulk.cards_named(name, use=False):
                if card.is_integer(0):
                    number = card.integer(0)
                    pid = card.integer(1) if name != "CONROD" and card.is_integer(1) else number
                    yield _Element(number, pid, name, name in SHELLS)

    def _add(self, card: Card) -> None:
        """NSM1: SID, TYPE, VALUE, then numbers of elements, sets or properties, or ALL."""
        if card.name != "NSM1" or "DISTR" in card.words_from(3):
            what = (
                "is in force, and NSM1" if card.name != "NSM1" else "has DISTR, by volume or mass, and NSM1 without it"
            )
            raise ValueError(
                f"{card} {what} alone is read; give its masses by NSM1 of set {card.word(0)}, or {BY_MATRICES}"
            )
        unit, value = self._bulk.units, card.real(2) * self._bulk.units.mass * self._bulk.wtmass
        elements = self._listed_elements(card, card.word(1))
        if not elements:
            raise ValueError(f"{card} names no element of the deck that takes nonstructural mass")
        for element in elements:
            added = value / unit.length ** (2 if element.has_area else 1)
            self._added[element.number] = self._added.get(element.number, 0.0) + added
            if element.has_area and self._added[element.number] < 0:
                raise ValueError(
                    f"{card} makes the nonstructural mass of element {element.number} negative; correct it"
                )

    def _listed_elements(self, card: Card, kind: str) -> list[_Element]:
        """Elements that a card lists: by their numbers, by sets of case control, or by their properties."""
        if kind not in KINDS:
            raise FieldError(f"{card} has {kind!r} in field 3; nonstructural mass is read of {', '.join(KINDS)}")
        fitting = [element for element in self._elements.values() if _fits(kind, element)]
        if card.word(3) == "ALL":
            return fitting
        by_number = {element.number: element for element in fitting}
        if kind == "ELSET":
            sets = numbers_of(card, 3, self._bulk.sets)
            numbers = [n for key in sets if key in self._bulk.sets for n in self._bulk.sets[key].among(by_number)]
            _refuse_unknown(card, "set", set(sets) if not numbers else set(sets) - self._bulk.sets.keys())
            return [by_number[n] for n in dict.fromkeys(numbers)]
        if kind in ("ELEMENT", "CONROD"):
            numbers = list(dict.fromkeys(numbers_of(card, 3, by_number)))
            _refuse_unknown(card, "element", set(numbers) - by_number.keys())
            return [by_number[n] for n in numbers]
        pids = {element.pid for element in fitting}
        listed_pids = set(numbers_of(card, 3, pids))
        _refuse_unknown(card, "property", listed_pids - pids)
        return [element for element in fitting if element.pid in listed_pids]


def _fits(kind: str, element: _Element) -> bool:
    """Whether an element is of the kind that a card names."""
    if kind in ("ELEMENT", "ELSET"):
        return True
    if kind == "CONROD" or element.card == "CONROD":
        return kind == element.card
    return element.has_area == (kind in AREA_PROPERTIES)


def _refuse_unknown(card: Card, kind: str, numbers: set[int]) -> None:
    if numbers and "THRU" not in card.words_from(3):  # the ends of a range need not exist
        raise ValueError(f"{card} names {kind} {min(numbers)}, of which the deck has no element that takes such mass")
