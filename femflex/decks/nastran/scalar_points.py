"""Scalar points, which model absorbers and sloshing liquid, as grid points of which one component exists.

A scalar point has one degree of freedom and no position. It is placed at the grid point that its springs and equations
join it to, and moves along the component that they name there. Its other components do not exist.
"""

from __future__ import annotations

import re
from contextlib import suppress

import numpy as np

from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card, FieldError, numbers_of
from femflex.decks.nastran.model import NastranModel, ScalarPoints

Component = tuple[int, int]  # number of a grid point, and 1 to 6
ELEMENTS = ("CELAS1", "CELAS2", "MPC", "CMASS1", "CMASS2")  # the first that names a grid point places it
EQUAL_MASSES = 1e-6  # relative difference of masses in several directions that are treated as one mass


def place_scalar_points(bulk: Bulk) -> ScalarPoints:
    """The scalar points of a deck, which has a grid point for each of them afterwards, and CELAS3 and CELAS4, CMASS3
    and CMASS4 as CELAS1 and CELAS2, CMASS1 and CMASS2."""
    for kind in ("CELAS", "CMASS"):
        for old, new in ((f"{kind}3", f"{kind}1"), (f"{kind}4", f"{kind}2")):
            for card in bulk.cards.pop(old, ()):
                padded = [*card.fields, "", "", "", ""]
                fields = [*padded[:3], "", padded[3], ""]
                bulk.cards.setdefault(new, []).append(Card(new, fields, card.location))
    cards_of_grids = {card.integer(0): card for card in bulk.cards.get("GRID", ()) if card.is_integer(0)}
    scalars = listed_scalar_points(bulk)
    links = [_ends(card) for name in ELEMENTS for card in bulk.cards.get(name, ())]
    scalars.update(n for link in links for n, c in link if not c and n not in cards_of_grids)
    places: dict[int, Component] = {}
    while True:
        reached: dict[int, Component] = {}
        for link in links:
            anchors = [end for end in link if end[0] in cards_of_grids and end[1]]
            anchors = anchors or [places[n] for n, _ in link if n in places]
            reached |= {n: anchors[0] for n, _ in link if anchors and n in scalars and n not in {*places, *reached}}
        if not reached:
            break
        places |= reached
    grid_of = _shared_grids(bulk, places)
    for number in dict.fromkeys(grid_of.values()):
        card = cards_of_grids[places[number][0]]
        bulk.cards["GRID"].append(Card("GRID", [str(number), *[*card.fields, *[""] * 5][1:6]], card.location))
    return ScalarPoints({n: (grid_of[n], c) for n, (_, c) in places.items()}, scalars - places.keys())


def listed_scalar_points(bulk: Bulk) -> set[int]:
    """Numbers of the scalar points of cards SPOINT."""
    scalars: set[int] = set()
    for card in bulk.cards_named("SPOINT", use=False):
        bulk.attempt(card, lambda card=card: scalars.update(numbers_of(card, 0)))  # type: ignore[misc]
    return scalars


def _ends(card: Card) -> list[Component]:
    """The grid and scalar points that a card names with their component, 0 where that is blank or not one of 1 to 6."""
    starts = (
        [k for start in range(1, len(card.fields), 8) for k in (start, start + 3)] if card.name == "MPC" else [2, 4]
    )
    components = {k: int(card.word(k + 1)) if re.fullmatch("[1-6]", card.word(k + 1)) else 0 for k in starts}
    return [(card.integer(k), c) for k, c in components.items() if card.is_integer(k) and card.integer(k) > 0]


def _shared_grids(bulk: Bulk, places: dict[int, Component]) -> dict[int, int]:
    """The grid point of each scalar point: those of equal mass along several axes of one grid point share one, as a
    single mass."""
    values, masses = dict[int, float](), dict[int, float]()
    for name in ("PMASS", "CMASS1", "CMASS2"):
        for card in bulk.cards.get(name, ()):
            with suppress(FieldError):  # which is reported where the card is read
                if name == "PMASS":
                    values.update(card.pairs(0, 2, 4, 6))
                elif len(ends := _ends(card)) == 1:
                    m = values.get(card.integer(1, card.integer(0)), 0.0) if name == "CMASS1" else card.real(1, 0.0)
                    masses[ends[0][0]] = masses.get(ends[0][0], 0.0) + m
    by_anchor: dict[int, list[int]] = {}
    for number, (anchor, component) in places.items():
        if component <= 3 and masses.get(number, 0.0) > 0:
            by_anchor.setdefault(anchor, []).append(number)
    grid_of = {number: number for number in places}
    for numbers in by_anchor.values():
        smallest, largest = min(masses[n] for n in numbers), max(masses[n] for n in numbers)
        if len({places[n][1] for n in numbers}) == len(numbers) and smallest > largest * (1 - EQUAL_MASSES):
            grid_of |= dict.fromkeys(numbers, numbers[0])
    return grid_of


def fix_absent_components(model: NastranModel) -> None:
    """Add the connections by which the components that scalar points do not have stay at zero."""
    for grid, components in model.scalars.components().items():
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
