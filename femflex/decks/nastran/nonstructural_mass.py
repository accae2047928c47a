"""Nonstructural mass of elements by cards of its own: NSM, NSM1, NSML, NSML1 and NSMADD."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card, FieldError, numbers_of
from femflex.decks.nastran.grids import Grids
from femflex.decks.nastran.shell_kinds import KINDS as SHELLS

LINES = ("CBAR", "CBEAM", "CBEAM3", "CROD", "CTUBE", "CONROD")  # per length
OF_AREAS = ("PSHELL", "PCOMP", "PCOMPG", "PSHEAR")
OF_LINES = ("PBAR", "PBARL", "PBEAM", "PBEAML", "PBCOMP", "PBEAM3", "PROD", "PTUBE")
CARDS = ("NSM", "NSM1", "NSML", "NSML1")


@dataclass(frozen=True)
class _Element:
    """An element that takes nonstructural mass: its number, property, corners or ends, and whether it has an area."""

    number: int
    pid: int
    grids: tuple[int, ...]
    flat: bool
    kind: str


class NonstructuralMass:
    """Mass per area [kg/m^2] or per length [kg/m] that cards of its own add to elements, by the element's number."""

    def __init__(self, bulk: Bulk, grids: Grids) -> None:
        self._bulk, self._grids = bulk, grids
        self._added: dict[int, float] = {}
        cards = [card for name in CARDS for card in bulk.each(name, use=False)]
        if not cards:
            return
        wanted = self._wanted(cards)
        self._elements = {one.number: one for one in self._every()}
        for card in cards:
            if card.is_integer(0) and card.integer(0) not in wanted:
                bulk.found.unused(
                    card.name, f"of set {card.integer(0)}, which case control does not select", card.place
                )
                continue
            bulk.found.use(card.name)
            bulk.attempt(card, partial(self._add, card))
        self._note()

    def __call__(self, number: int) -> float:
        """What the cards add to an element, [kg/m^2] or [kg/m]; 0 where they name it nowhere."""
        return self._added.get(number, 0.0)

    def _wanted(self, cards: list[Card]) -> set[int]:
        """Numbers of the sets in force: that of case control, or those that NSMADD adds up to it."""
        bulk = self._bulk
        chosen = bulk.chosen.get("NSM")
        known = {card.integer(0) for card in cards if card.is_integer(0)}
        sums: dict[int, list[int]] = {}
        for card in bulk.each("NSMADD"):
            bulk.attempt(card, partial(self._add_sum, card, sums))
        if chosen is None and len(known) == 1 and not bulk.raw.control:
            chosen = next(iter(known))
            bulk.found.note(f"no case control names an NSM set; the only one, {chosen}, is used")
        if chosen is None:
            return set()
        wanted = set(sums.get(chosen, [chosen]))  # a sum counts before cards of its number
        for number in sorted(wanted - known):
            bulk.found.note(f"NSM set {number} is in force, and the deck has no card of it; it adds no mass")
        return wanted

    def _add_sum(self, card: Card, sums: dict[int, list[int]]) -> None:
        sums[card.integer(0)] = numbers_of(card, 1)

    def _every(self) -> Iterator[_Element]:
        """The elements of the deck that take nonstructural mass, as far as they can be read."""
        for name in (*SHELLS, *LINES):
            for card in self._bulk.each(name, use=False):
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
                chosen = [one for one in self._elements.values() if self._fits(kind, one, card)]
            else:
                chosen = self._chosen(card, kind, lambda known: numbers_of(card, 3, known))
            if not chosen:
                raise ValueError(f"{card} names no element of the deck that takes nonstructural mass")
            self._give(card, chosen, card.real(2) * factor, lumped)
            return
        for k in range(2, len(card.fields), 2):
            if card.has(k):
                number = card.integer(k)
                chosen = self._chosen(card, kind, lambda known, number=number: [number])  # type: ignore[misc]
                self._give(card, chosen, card.real(k + 1) * factor, lumped)

    def _chosen(self, card: Card, kind: str, listed: Callable[[Collection[int]], Iterable[int]]) -> list[_Element]:
        """Elements that a card lists: by their numbers, by sets of case control, or by their properties."""
        if kind == "ELSET":
            sets = list(listed(self._bulk.sets))
            self._refuse_unknown(card, "set", set(sets) - self._bulk.sets.keys())
            numbers = [n for key in sets if key in self._bulk.sets for n in self._bulk.sets[key].among(self._elements)]
            self._refuse_unknown(card, "set", set(sets) if not numbers else set())
            return [self._elements[n] for n in dict.fromkeys(numbers)]
        fitting = [one for one in self._elements.values() if self._fits(kind, one, card)]
        if kind in ("ELEMENT", "CONROD"):
            known = {one.number: one for one in fitting}
            numbers = list(dict.fromkeys(listed(known)))
            self._refuse_unknown(card, "element", set(numbers) - known.keys())
            return [known[n] for n in numbers if n in known]
        pids = {one.pid for one in fitting}
        named = set(listed(pids))
        self._refuse_unknown(card, "property", named - pids)
        return [one for one in fitting if one.pid in named]

    def _refuse_unknown(self, card: Card, what: str, numbers: set[int]) -> None:
        if numbers and "THRU" not in card.rest(3):  # ranges may begin and end between numbers
            raise ValueError(
                f"{card} names {what} {min(numbers)}, of which the deck has no element that takes such mass"
            )

    def _fits(self, kind: str, one: _Element, card: Card) -> bool:
        if kind in ("ELEMENT", "ELSET"):
            return True
        if kind == "CONROD":
            return one.kind == "CONROD"
        if kind not in (*OF_AREAS, *OF_LINES):
            known = ", ".join(("ELEMENT", "ELSET", "CONROD", *OF_AREAS, *OF_LINES))
            raise FieldError(f"{card} has {kind!r} in field 3; nonstructural mass is read of {known}")
        return one.flat == (kind in OF_AREAS) and one.kind != "CONROD"

    def _give(self, card: Card, chosen: list[_Element], value: float, lumped: bool) -> None:
        """Add a value [kg, or kg per deck unit of area or length] to elements; a lumped one is spread over them all."""
        unit = self._bulk.units.length
        if lumped:
            if len({one.flat for one in chosen}) > 1:
                raise ValueError(
                    f"{card} spreads a mass over elements with areas and with lengths; give one card for each"
                )
            value /= sum(map(self._size, chosen))
        for one in chosen:
            per = 1.0 if lumped else unit ** (2 if one.flat else 1)
            self._added[one.number] = self._added.get(one.number, 0.0) + value / per
            if one.flat and self._added[one.number] < 0:
                raise ValueError(f"{card} makes the nonstructural mass of element {one.number} negative; correct it")

    def _size(self, one: _Element) -> float:
        """Area [m^2] or length [m]."""
        x = [self._grids[grid].position for grid in one.grids]
        if not one.flat:
            return float(np.linalg.norm(x[1] - x[0]))
        area = np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0]))
        return float(area if len(x) == 3 else np.linalg.norm(np.cross(x[2] - x[0], x[3] - x[1]))) / 2

    def _note(self) -> None:
        if self._added:
            total = sum(self._size(self._elements[n]) * value for n, value in self._added.items())
            self._bulk.found.note(f"NSM cards add {total:.6g} kg of nonstructural mass to {len(self._added)} elements")
