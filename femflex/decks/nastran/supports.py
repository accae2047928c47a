"""Single-point constraints: SPC, SPC1, SPCADD and the components fixed on GRID cards."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.card import Card, numbers_of
from femflex.decks.nastran.model import NastranModel
from femflex.fem import Support

SupportSet = dict[str, Support]
EVERY = {1, 2, 3, 4, 5, 6}


def read_supports(model: NastranModel) -> tuple[dict[str, SupportSet], tuple[str, ...]]:
    """Sets of supports by name, spc_1 ..., and the names of the active ones: that of case control, and that of GRID
    cards.

    Supports of grids without displacements are dropped; supports of dependent components are problems.
    """
    bulk = model.bulk
    components_of = model.scalars.components()
    points = {*model.grids, *model.scalars.places, *model.scalars.alone}
    fixed_by_set: dict[int, dict[int, set[int]]] = {}
    added: dict[int, list[int]] = {}

    def fix(card: Card, number: int, grids: list[int], components: tuple[int, ...]) -> None:
        components_of_grid = fixed_by_set.setdefault(number, dict[int, set[int]]())
        if not model.grids.require(grids, card):
            return
        for g in grids:
            present = components_of.get(g, EVERY)
            clash = [c for c in components if (g, c) in model.depending and c in present]
            if clash and number in in_force:
                bulk.findings.problem(
                    f"{card} fixes component {clash[0]} of grid {g}, which is dependent in "
                    f"{model.depending[g, clash[0]]}; fix the independent components instead", card.location,
                )  # fmt: skip
                continue
            components_of_grid.setdefault(g, set()).update(c for c in components if c in present)

    def spc(card: Card) -> None:
        for k in (1, 4):
            if card.has(k):
                if card.integer(k) not in model.scalars.alone:
                    (grid, components), *_ = model.placed_ends(card, [(card.integer(k), card.components(k + 1))])
                    fix(card, card.integer(0), [grid], components)
                if card.real(k + 2, 0.0):
                    text = "prescribed displacement is left out; the component is held at zero"
                    bulk.findings.unused(f"{card.name} D", text, card.location)

    def spc1(card: Card) -> None:
        places, grids = model.scalars.places, list[int]()
        for number in numbers_of(card, 2, points):
            if number in places:
                fix(card, card.integer(0), [places[number][0]], places[number][1:])
            elif number not in model.scalars.alone and (number in model.grids or "THRU" not in card.words_from(2)):
                grids.append(number)  # missing grids of a range are skipped
        fix(card, card.integer(0), grids, card.components(1))

    selected = bulk.selected_sets.get("SPC")
    for card in bulk.cards_named("SPCADD"):
        if card.is_integer(0):
            bulk.attempt(card, lambda card=card: added.setdefault(card.integer(0), numbers_of(card, 1)))  # type: ignore[misc]
    in_force = set(added.get(selected, [selected])) if selected is not None else set[int]()
    bulk.for_each_card(spc, "SPC")
    bulk.for_each_card(spc1, "SPC1")
    for card in bulk.cards_named("SPCOFF", "SPCOFF1", "SPCR", use=False):
        bulk.findings.unused(card.name, "changes of constraints are left out", card.location)
    if selected is not None and not in_force & fixed_by_set.keys():
        if fixed_by_set or added:
            bulk.findings.problem(
                f"case control names SPC set {selected}, which the deck does not have; it has "
                f"{sorted(fixed_by_set | added)}"
            )
        else:
            bulk.findings.note(f"case control names SPC set {selected}, and the deck has no SPC card; it fixes nothing")
    for number, parts in added.items():
        combined = dict[int, set[int]]()
        for part in parts:
            for g, components in fixed_by_set.get(part, {}).items():
                combined.setdefault(g, set()).update(components)
        fixed_by_set[number] = combined
    sets = {f"spc_{n}": _support_groups(model, fixed, f"spc_{n}") for n, fixed in fixed_by_set.items()}
    on_cards: dict[int, set[int]] = {}
    for g in model.grids.numbers():
        grid = model.grids[g]
        for c in grid.fixed:
            if (g, c) in model.depending:
                bulk.findings.problem(
                    f"{grid.card} fixes component {c}, which is dependent in {model.depending[g, c]}; fix the "
                    "independent components instead", grid.card.location,
                )  # fmt: skip
            else:
                on_cards.setdefault(g, set()).add(c)
    sets["ps"] = _support_groups(model, on_cards, "ps")
    default = ("ps", f"spc_{selected}")
    return {name: one for name, one in sets.items() if one}, tuple(name for name in default if sets.get(name))


def _support_groups(model: NastranModel, components_of_grid: dict[int, set[int]], name: str) -> SupportSet:
    """Groups and supports of grids with their components, and a group `name` of all these grids."""
    used = {g: components for g, components in components_of_grid.items() if g in model.build.row_of}

    def axes(g: int) -> Array:
        is_isotropic = all(set(part) <= used[g] or not set(part) & used[g] for part in ((1, 2, 3), (4, 5, 6)))
        return np.eye(3) if is_isotropic else model.grids.axes(g)

    supports = model.support_set(used, axes, lambda components: f"{name}-{''.join(map(str, components))}")
    if supports:
        groups = model.build.point_groups
        groups[name] = [row for group in supports for row in groups[group]]
    return supports
