"""Scalar points, which model absorbers and sloshing liquid, as grid points of which one component exists.

A scalar point has one degree of freedom and no position. It is placed at the grid point that its springs and equations
join it to, and moves along the component that they name there. Its other components do not exist.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card, FieldError, numbers_of
from femflex.decks.nastran.model import NastranModel

Component = tuple[int, int]  # number of a grid point, and 1 to 6
ELEMENTS = ("CELAS1", "CELAS2", "MPC", "CMASS1", "CMASS2")  # the first that names a grid point places it
EQUAL_MASSES = 1e-6  # relative difference of masses in several directions that are treated as one mass


def place_scalar_points(bulk: Bulk) -> dict[int, set[int]]:
    """Number -> components of the grid points that now stand for the scalar points of the cards.

    Springs, masses, equations and supports of scalar points then name them as those of grid points.
    """
    for name in ("CELAS", "CMASS"):
        for old, new in ((f"{name}3", f"{name}1"), (f"{name}4", f"{name}2")):
            for card in bulk.cards.pop(old, ()):
                fields = [*card.fields, "", "", "", ""]
                paired = [*fields[:3], "", fields[3], ""]
                bulk.cards.setdefault(new, []).append(Card(new, paired, card.location))
    scalars = _scalar_points(bulk)
    if not scalars:
        return {}
    places = _places(bulk, scalars)
    _share_grids(bulk, places)
    alone = scalars - places.keys()
    components: dict[int, set[int]] = {}
    cards_of_grids = {card.integer(0): card for card in bulk.cards.get("GRID", ()) if card.is_integer(0)}
    for grid, (anchor, component) in places.values():
        if grid not in components:
            card = cards_of_grids[anchor]
            fields = [*card.fields, "", "", "", "", ""]
            bulk.cards["GRID"].append(Card("GRID", [str(grid), *fields[1:6]], card.location))
        components.setdefault(grid, set()).add(component)
    targets = {number: (grid, component) for number, (grid, (_, component)) in places.items()}
    for name in (*ELEMENTS, "SPC", "SPC1"):
        kept: list[Card] = []
        for card in bulk.cards.get(name, ()):
            if name[:3] != "SPC" and alone & {number for number, _, _ in _ends(card)}:
                text = "of scalar points that nothing joins to a grid point; they are left out, and missing"
                bulk.findings.unused(name, text, card.location)
            else:
                kept += _spc1(card, targets, alone) if name == "SPC1" else [_renamed(card, targets)]
        if name in bulk.cards:
            bulk.cards[name] = kept
    return components


def listed_scalar_points(bulk: Bulk) -> set[int]:
    """Numbers of the scalar points of cards SPOINT."""
    scalars: set[int] = set()
    for card in bulk.cards_named("SPOINT", use=False):
        bulk.attempt(card, lambda card=card: scalars.update(numbers_of(card, 0)))  # type: ignore[misc]
    return scalars


def _scalar_points(bulk: Bulk) -> set[int]:
    """Numbers of the scalar points: of cards SPOINT, and those that elements name without a component."""
    grids = {card.word(0) for card in bulk.cards.get("GRID", ())}
    scalars = listed_scalar_points(bulk)
    for name in ELEMENTS:
        for card in bulk.cards.get(name, ()):
            ends = _ends(card)
            scalars.update(number for number, _, k in ends if not _component(card, k) and str(number) not in grids)
    return scalars


def _ends(card: Card) -> list[tuple[int, int, int]]:
    """Number of each grid or scalar point that a card names, with the fields of the number and of its component."""
    fields: list[tuple[int, int]] = []
    if card.name[:5] in ("CELAS", "CMASS"):
        fields = [(2, 3), (4, 5)]
    elif card.name == "SPC":
        fields = [(1, 2), (4, 5)]
    elif card.name == "MPC":
        fields = [(k, k + 1) for start in range(1, len(card.fields), 8) for k in (start, start + 3)]
    return [(card.integer(k), k, c) for k, c in fields if card.is_integer(k) and card.integer(k) > 0]


def _component(card: Card, k: int) -> int:
    """The component in field k, 0 where it is blank or not one of 1 to 6."""
    return int(card.word(k)) if card.word(k) in ("1", "2", "3", "4", "5", "6") else 0


def _places(bulk: Bulk, scalars: set[int]) -> dict[int, tuple[int, Component]]:
    """Scalar point -> its number, and the component of a grid point that it is placed at."""
    links: list[list[Component]] = []
    for name in ELEMENTS:
        links += [[(n, _component(card, k)) for n, _, k in _ends(card)] for card in bulk.cards.get(name, ())]
    links = [link for link in links if len(link) > 1 and any(n in scalars for n, _ in link)]
    grids = {card.integer(0) for card in bulk.cards.get("GRID", ()) if card.is_integer(0)}
    places: dict[int, tuple[int, Component]] = {}
    while True:
        reached: dict[int, tuple[int, Component]] = {}
        for link in links:
            at_grids = [end for end in link if end[0] in grids and end[1]]
            anchors = at_grids or [places[n][1] for n, _ in link if n in places]
            if anchors:
                new = [n for n, _ in link if n in scalars and n not in places and n not in reached]
                reached |= {n: (n, anchors[0]) for n in new}
        if not reached:
            return places
        places |= reached


def _share_grids(bulk: Bulk, places: dict[int, tuple[int, Component]]) -> None:
    """Let scalar points of equal mass along several axes of one grid point be one grid point: a single mass."""
    properties = {
        card.word(k): card.real(k + 1, 0.0)
        for card in bulk.cards.get("PMASS", ())
        for k in (0, 2, 4, 6)
        if card.has(k) and _is_real(card, k + 1)
    }
    masses: dict[int, float] = {}
    for name in ("CMASS1", "CMASS2"):
        for card in bulk.cards.get(name, ()):
            ends = _ends(card)
            if len(ends) == 1 and ends[0][0] in places and (name == "CMASS1" or _is_real(card, 1)):
                m = properties.get(card.word(1, card.word(0)), 0.0) if name == "CMASS1" else card.real(1, 0.0)
                masses[ends[0][0]] = masses.get(ends[0][0], 0.0) + m
    by_anchor: dict[int, list[int]] = {}
    for number, (_, (anchor, component)) in places.items():
        if component <= 3 and masses.get(number, 0.0) > 0:
            by_anchor.setdefault(anchor, []).append(number)
    for numbers in by_anchor.values():
        components = {places[n][1][1] for n in numbers}
        values = [masses[n] for n in numbers]
        if len(components) == len(numbers) and min(values) > max(values) * (1 - EQUAL_MASSES):
            for n in numbers:
                places[n] = numbers[0], places[n][1]


def _is_real(card: Card, k: int) -> bool:
    try:
        card.real(k, 0.0)
    except FieldError:
        return False
    return True


def _renamed(card: Card, targets: dict[int, Component]) -> Card:
    """The card with grid points and components in place of scalar points."""
    fields = [*card.fields, "", ""]
    for number, k, c in _ends(card):
        if number in targets:
            fields[k], fields[c] = map(str, targets[number])
    return replace(card, fields=fields)


def _spc1(card: Card, targets: dict[int, Component], alone: set[int]) -> Iterator[Card]:
    """The card, or one for its grid points and one for each of its scalar points."""
    try:
        numbers = numbers_of(card, 2, targets.keys() | alone)
    except FieldError:
        numbers = []
    for number in numbers:
        if number in targets:
            grid, component = targets[number]
            yield replace(card, fields=[card.word(0), str(component), str(grid)])
    if "THRU" in card.words_from(2) or not set(numbers) & (targets.keys() | alone):
        yield card
    elif others := [str(n) for n in numbers if n not in targets and n not in alone]:
        yield replace(card, fields=[*card.fields[:2], *others])


def fix_absent_components(model: NastranModel) -> None:
    """Add the connections by which the components that scalar points do not have stay at zero."""
    for grid, components in model.scalar_points.items():
        if grid not in model.required | model.moving:
            continue
        absent = tuple(c for c in range(1, 7 if grid in model.required_turning else 4) if c not in components)
        if absent:
            zero = np.zeros((len(absent), 0))
            model.add_equations(grid, absent, [], zero, model.grids.axes(grid), f"scalar point {grid}")
        if any(g == grid for g, *_ in model.masses):
            model.bulk.findings.note(
                f"the mass of scalar point {grid} moves in component {', '.join(map(str, sorted(components)))} "
                "of its grid point; in the other directions it is fixed to the body's frame"
            )
