"""Single-point constraints: SPC, SPC1, SPCADD and the components held on GRID cards."""

from __future__ import annotations

import numpy as np

from femflex.decks.builder import direction_key
from femflex.decks.nastran.card import Card, numbers_of
from femflex.decks.nastran.model import WORDS, NastranModel
from femflex.fem import Support

Held = dict[str, Support]


def read_supports(model: NastranModel) -> tuple[dict[str, Held], tuple[str, ...]]:
    """Sets of supports by name, spc_1 ..., and the names of those in force: case control's, and those on GRID cards.

    Supports of grids that nothing moves are dropped; those of components that follow others are problems.
    """
    bulk = model.bulk
    held: dict[int, dict[int, set[int]]] = {}
    added: dict[int, list[int]] = {}

    def hold(card: Card, number: int, grids: list[int], components: tuple[int, ...]) -> None:
        own = held.setdefault(number, {})
        if not model.grids.require([g for g in grids if g not in model.grids.scalars], card):
            return
        for g in grids:
            if g in model.grids.scalars:
                bulk.found.unused(f"{card.name} of scalar points", "scalar points are left out", card.place)
                continue
            clash = [c for c in components if (g, c) in model.depending]
            if clash and number in in_force:
                first = model.depending[g, clash[0]]
                bulk.found.problem(
                    f"{card} fixes component {clash[0]} of grid {g}, which is dependent in {first} "
                    f"({first.place}); fix the independent components instead",
                    card.place,
                )
                continue
            own.setdefault(g, set()).update(components)

    def spc(card: Card) -> None:
        for k in (1, 4):
            if card.has(k):
                hold(card, card.integer(0), [card.integer(k)], card.components(k + 1))
                if card.real(k + 2, 0.0):
                    bulk.found.unused(
                        f"{card.name} D",
                        "prescribed displacement is left out; the component is held at zero",
                        card.place,
                    )

    def spc1(card: Card) -> None:
        listed = numbers_of(card, 2, model.grids)
        if "THRU" in card.rest(2):  # grids that are not there are passed over
            listed = [g for g in listed if g in model.grids]
        hold(card, card.integer(0), listed, card.components(1))

    chosen = bulk.chosen.get("SPC")
    for card in bulk.each("SPCADD"):
        if card.is_integer(0):
            bulk.attempt(card, lambda card=card: added.setdefault(card.integer(0), numbers_of(card, 1)))  # type: ignore[misc]
    in_force = set(added.get(chosen, [chosen])) if chosen is not None else set[int]()
    bulk.trying(spc, "SPC")
    bulk.trying(spc1, "SPC1")
    for card in bulk.each("SPCOFF", "SPCOFF1", "SPCR", use=False):
        bulk.found.unused(card.name, "changes of constraints are left out", card.place)
    if chosen is not None and not in_force & held.keys():
        if held or added:
            bulk.found.problem(
                f"case control names SPC set {chosen}, which the deck does not have; it has {sorted(held | added)}"
            )
        else:
            bulk.found.note(f"case control names SPC set {chosen}, and the deck has no SPC card; it fixes nothing")
    sets: dict[str, Held] = {}
    for number, own in held.items():
        sets[f"spc_{number}"] = _held(model, own, f"spc_{number}")
    for number, parts in added.items():
        united: dict[int, set[int]] = {}
        for part in parts:
            for g, components in held.get(part, {}).items():
                united.setdefault(g, set()).update(components)
        sets[f"spc_{number}"] = _held(model, united, f"spc_{number}")
    on_cards: dict[int, set[int]] = {}
    for g in model.grids.numbers():
        grid = model.grids[g]
        for c in grid.held:
            if (g, c) in model.depending:
                first = model.depending[g, c]
                bulk.found.problem(
                    f"{grid.card} fixes component {c}, which is dependent in {first} ({first.place}); fix the "
                    "independent components instead",
                    grid.card.place,
                )
            else:
                on_cards.setdefault(g, set()).add(c)
    default = []
    if on_cards:
        sets["ps"] = _held(model, on_cards, "ps")
        default.append("ps")
    if chosen is not None:
        default.append(f"spc_{chosen}")
    return {name: one for name, one in sets.items() if one}, tuple(name for name in default if sets.get(name))


def _held(model: NastranModel, own: dict[int, set[int]], name: str) -> Held:
    """Groups and supports of grids with their components: one for each set of components and axes."""
    groups: dict[tuple[tuple[int, ...], tuple[float, ...]], list[int]] = {}
    everywhere: list[int] = []
    for g, components in own.items():
        if g not in model.build.row_of:
            continue
        there = tuple(c for c in sorted(components) if c <= 3 or g in model.turning)
        if not there:
            continue
        full = all(set(part) <= components or not set(part) & components for part in ((1, 2, 3), (4, 5, 6)))
        axes = np.eye(3) if full else model.grids.axes(g)
        groups.setdefault((there, direction_key(axes.ravel())), []).append(model.row(g))
        everywhere.append(model.row(g))
    found: Held = {}
    for (components_, axes_key), rows in groups.items():
        base = f"{name}-{''.join(map(str, components_))}"
        group, k = base, 1
        while group in found:
            k += 1
            group = f"{base}-{k}"
        model.build.point_groups[group] = rows
        frame = np.array(axes_key).reshape(3, 3)
        found[group] = Support(tuple(WORDS[c - 1] for c in components_), tuple(map(tuple, frame.tolist())))
    if found:
        model.build.point_groups[name] = everywhere
    return found
