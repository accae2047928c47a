"""Nonstructural mass from separate cards: NSM, NSM1, NSML, NSML1 and NSMADD."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card, FieldError, numbers_of
from femflex.decks.nastran.grids import Grids
from femflex.decks.nastran.shell_kinds import KINDS as SHELLS

LINE_CARDS = ("CBAR", "CBEAM", "CBEAM3", "CROD", "CTUBE", "CONROD")  # per length
AREA_PROPERTIES = ("PSHELL", "PCOMP", "PCOMPG", "PSHEAR")
LINE_PROPERTIES = ("PBAR", "PBARL", "PBEAM", "PBEAML", "PBCOMP", "PBEAM3", "PROD", "PTUBE")
CARDS = ("NSM", "NSM1", "NSML", "NSML1")


@dataclass(frozen=True)
class _Element:
    """An element that accepts nonstructural mass: its number, property, corners or ends, and whether it has an area."""

    number: int
    pid: int
    grids: tuple[int, ...]
    has_area: bool
    kind: str


class NonstructuralMass:
    """Mass per area [kg/m^2] or per length [kg/m] that NSM cards add to elements, by element number."""

    def __init__(self, bulk: Bulk, grids: Grids) -> None:
        self._bulk, self._grids = bulk, grids
        self._added: dict[int, float] = {}
        cards = [card for name in CARDS for card in bulk.cards_named(name, use=False)]
        if not cards:
            return
        active = self._active_sets(cards)
        self._elements = {element.number: element for element in self._all_elements()}
        for card in cards:
            if card.is_integer(0) and card.integer(0) not in active:
                bulk.findings.unused(
                    card.name, f"of set {card.integer(0)}, which case control does not select", card.location
                )
                continue
            bulk.findings.use(card.name)
            bulk.attempt(card, partial(self._add, card))
        self._note_total()

    def __call__(self, number: int) -> float:
        """Mass that the cards add to an element, [kg/m^2] or [kg/m]; 0 if they do not name it."""
        return self._added.get(number, 0.0)

    def _active_sets(self, cards: list[Card]) -> set[int]:
        """Numbers of the active sets: that of case control, or those that its NSMADD adds up."""
        bulk = self._bulk
        selected = bulk.selected_sets.get("NSM")
        defined = {card.integer(0) for card in cards if card.is_integer(0)}
        sums: dict[int, list[int]] = {}
        for card in bulk.cards_named("NSMADD"):
            bulk.attempt(card, partial(self._add_sum, card, sums))
        if selected is None and len(defined) == 1 and not bulk.raw.control:
            selected = next(iter(defined))
            bulk.findings.note(f"no case control names an NSM set; the only one, {selected}, is used")
        if selected is None:
            return set()
        active = set(sums.get(selected, [selected]))  # NSMADD takes precedence over cards with its number
        for number in sorted(active - defined):
            bulk.findings.note(f"NSM set {number} is in force, and the deck has no card of it; it adds no mass")
        return active

    def _add_sum(self, card: Card, sums: dict[int, list[int]]) -> None:
        sums[card.integer(0)] = numbers_of(card, 1)

    def _all_elements(self) -> Iterator[_Element]:
        """The readable elements of the deck that accept nonstructural mass."""
        for name in (*SHELLS, *LINE_CARDS):
            for card in self._bulk.cards_named(name, use=False):
                ends = SHELLS[name].corners if name in SHELLS else 2
                first = 1 if name == "CONROD" else 2
                if card.is_integer(0) and all(card.is_integer(first + k) for k in range(ends)):
                    number = card.integer(0)
                    pid = card.integer(1) if name != "CONROD" and card.is_integer(1) else number
                    grids = tuple(card.integer(first + k) for k in range(ends))
                    if all(grid in self._grids for grid in grids):
                        yield _Element(number, pid, grids, name in SHELLS, name)

    def _add(self, card: Card) -> None:
        kind = card.word(1)
        last = next((k for k in range(2, len(card.fields)) if card.word(k) == "DISTR"), len(card.fields))
        if last < len(card.fields):
            raise ValueError(f"{card} has DISTR, by volume or mass, which is not read; give values by area or length")
        lumped = card.name.startswith("NSML")
        factor = self._bulk.units.mass * self._bulk.wtmass
        if card.name.endswith("1"):
            if card.word(3) == "ALL":
                elements = [element for element in self._elements.values() if self._fits(kind, element, card)]
            else:
                elements = self._listed_elements(card, kind, lambda known: numbers_of(card, 3, known))
            if not elements:
                raise ValueError(f"{card} names no element of the deck that takes nonstructural mass")
            self._add_mass(card, elements, card.real(2) * factor, lumped)
            return
        for k in range(2, len(card.fields), 2):
            if card.has(k):
                number = card.integer(k)
                elements = self._listed_elements(card, kind, lambda known, number=number: [number])  # type: ignore[misc]
                self._add_mass(card, elements, card.real(k + 1) * factor, lumped)

    def _listed_elements(
        self, card: Card, kind: str, numbers_among: Callable[[Collection[int]], Iterable[int]]
    ) -> list[_Element]:
        """Elements that a card lists: by their numbers, by sets of case control, or by their properties."""
        if kind == "ELSET":
            sets = list(numbers_among(self._bulk.sets))
            self._refuse_unknown(card, "set", set(sets) - self._bulk.sets.keys())
            numbers = [n for key in sets if key in self._bulk.sets for n in self._bulk.sets[key].among(self._elements)]
            self._refuse_unknown(card, "set", set(sets) if not numbers else set())
            return [self._elements[n] for n in dict.fromkeys(numbers)]
        fitting = [element for element in self._elements.values() if self._fits(kind, element, card)]
        if kind in ("ELEMENT", "CONROD"):
            by_number = {element.number: element for element in fitting}
            numbers = list(dict.fromkeys(numbers_among(by_number)))
            self._refuse_unknown(card, "element", set(numbers) - by_number.keys())
            return [by_number[n] for n in numbers if n in by_number]
        pids = {element.pid for element in fitting}
        listed_pids = set(numbers_among(pids))
        self._refuse_unknown(card, "property", listed_pids - pids)
        return [element for element in fitting if element.pid in listed_pids]

    def _refuse_unknown(self, card: Card, kind: str, numbers: set[int]) -> None:
        if numbers and "THRU" not in card.words_from(3):  # the ends of a range need not exist
            raise ValueError(
                f"{card} names {kind} {min(numbers)}, of which the deck has no element that takes such mass"
            )

    def _fits(self, kind: str, element: _Element, card: Card) -> bool:
        if kind in ("ELEMENT", "ELSET"):
            return True
        if kind == "CONROD":
            return element.kind == "CONROD"
        if kind not in (*AREA_PROPERTIES, *LINE_PROPERTIES):
            kinds = ", ".join(("ELEMENT", "ELSET", "CONROD", *AREA_PROPERTIES, *LINE_PROPERTIES))
            raise FieldError(f"{card} has {kind!r} in field 3; nonstructural mass is read of {kinds}")
        return element.has_area == (kind in AREA_PROPERTIES) and element.kind != "CONROD"

    def _add_mass(self, card: Card, elements: list[_Element], value: float, lumped: bool) -> None:
        """Add a value [kg, or kg per deck unit of area or length] to elements; a lumped one is distributed over all of
        them."""
        unit = self._bulk.units.length
        if lumped:
            if len({element.has_area for element in elements}) > 1:
                raise ValueError(
                    f"{card} spreads a mass over elements with areas and with lengths; give one card for each"
                )
            value /= sum(map(self._size, elements))
        for element in elements:
            area_or_length = 1.0 if lumped else unit ** (2 if element.has_area else 1)
            self._added[element.number] = self._added.get(element.number, 0.0) + value / area_or_length
            if element.has_area and self._added[element.number] < 0:
                raise ValueError(
                    f"{card} makes the nonstructural mass of element {element.number} negative; correct it"
                )

    def _size(self, element: _Element) -> float:
        """Area [m^2] or length [m]."""
        x = [self._grids[grid].position for grid in element.grids]
        if not element.has_area:
            return float(np.linalg.norm(x[1] - x[0]))
        area = np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0]))
        return float(area if len(x) == 3 else np.linalg.norm(np.cross(x[2] - x[0], x[3] - x[1]))) / 2

    def _note_total(self) -> None:
        if self._added:
            total = sum(self._size(self._elements[n]) * value for n, value in self._added.items())
            self._bulk.findings.note(
                f"NSM cards add {total:.6g} kg of nonstructural mass to {len(self._added)} elements"
            )
