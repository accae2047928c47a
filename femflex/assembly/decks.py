"""Read the deck of a body, and use it for the mesh, members and clamps of the body's table."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from femflex.arrays import IntArray
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.case.mesh_groups import referenced_groups
from femflex.case.shape import MarkerTable
from femflex.decks import Deck, read_deck
from femflex.decks.deck import AUTOSPC
from femflex.fem import Member, Support
from femflex.fem.static_loads import StaticLoads
from femflex.fem.support import COMPONENTS
from femflex.mesh import Mesh
from femflex.mesh.refine import refined_values
from femflex.noun.problems import CaseError, Problem, suggestion_text

IN_FORCE = "supports"  # in a clamp: the supports selected by the case control of the deck
ALL_NODES_OF = "all of {}"  # group of all nodes of a set of supports


def deck_of(case: Case, name: str, table: FlexibleTable) -> Deck | None:
    """The deck of a body, with groups for the nodes that its table names; None if the body has a mesh.

    Raises CaseError if the deck cannot be read.
    """
    if table.deck is None:
        return None
    path = case.path.parent / table.deck
    try:
        modified = path.stat().st_mtime_ns if path.is_file() else 0
        deck = _read_cached(str(path), modified, table.units, json.dumps(table.overrides, sort_keys=True))
        deck = deck.with_node_groups(group for _, group in referenced_groups("", table))
        return replace(deck, mesh=deck.mesh.with_groups(points=_supports_with_joints(case, name, deck)))
    except (ValueError, OSError) as error:
        raise CaseError(case.path.name, [Problem(f"bodies.{name}.deck", str(error))]) from None


def _supports_with_joints(case: Case, name: str, deck: Deck) -> dict[str, list[int]]:
    """Group -> all supported points of a set of supports, for every set that a joint names as marker."""
    ends = [(joint.child, joint.child_marker) for joint in case.joints]
    ends += [(joint.parent, joint.parent_marker) for joint in case.joints if joint.parent is not None]
    sets = {IN_FORCE: deck.active_supports(), **deck.supports}
    points = {}
    for marker in dict.fromkeys(marker for body, marker in ends if body == name and marker in sets):
        if marker not in deck.mesh.groups:
            groups = [group for group in sets[marker] if not group.startswith(AUTOSPC)]
            points[ALL_NODES_OF.format(marker)] = sorted({int(p) for g in groups for p in deck.mesh.group_points(g)})
    return {group: rows for group, rows in points.items() if rows}


@lru_cache(maxsize=4)
def _read_cached(path: str, stamp: int, units: str, overrides: str) -> Deck:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the trial run that detects unresisted components
        return read_deck(Path(path), units, json.loads(overrides))


def with_deck(case: Case, name: str, table: FlexibleTable) -> FlexibleTable:
    """The table in whose clamp the deck's sets of supports are replaced by the groups that they support.

    "supports" stands for those in force in the deck. Components without stiffness are fixed with any clamp.
    """
    deck = deck_of(case, name, table)
    r = table.reduction
    clamp: Mapping[str, Support] = getattr(r, "clamp", {})
    if deck is None or r is None or not clamp:
        return table
    clamped: dict[str, Support] = {}
    adds_autospc = AUTOSPC in deck.supports and not any(one.startswith(AUTOSPC) for one in clamp)
    for group, value in {**clamp, **({AUTOSPC: Support(COMPONENTS)} if adds_autospc else {})}.items():
        if group == IN_FORCE and group not in deck.mesh.groups:
            if not deck.default_supports:
                text = (
                    f"found 'supports', and case control of {deck.name} names no set of supports; its sets are "
                    f"{sorted(deck.supports) or 'none'}"
                )
                raise CaseError(case.path.name, [Problem(f"bodies.{name}.reduction.clamp", text)])
            clamped |= deck.active_supports()
        elif group in deck.supports and value.is_clamped:
            clamped |= deck.supports[group]
        elif group in deck.mesh.groups:
            clamped[group] = value
        else:
            text = f"found {group!r}; {suggestion_text(group, [*deck.supports, IN_FORCE, *deck.mesh.groups])}"
            raise CaseError(case.path.name, [Problem(f"bodies.{name}.reduction.clamp", text)])
    sets = [group for group in clamp if ALL_NODES_OF.format(group) in deck.mesh.groups and group not in table.markers]
    markers = {group: MarkerTable(group=ALL_NODES_OF.format(group)) for group in sets}
    return table.model_copy(
        update={"reduction": r.model_copy(update={"clamp": clamped}), "markers": {**table.markers, **markers}}
    )


def load_sets_of(case: Case, name: str, table: FlexibleTable) -> dict[str, StaticLoads]:
    """The sets of loads of a body's deck that effectors of the case name. Raises CaseError for unknown ones."""
    deck = deck_of(case, name, table)
    sets: dict[str, StaticLoads] = {}
    if deck is None:
        return sets  # reported where the loads are built
    for heading, nouns in case.effectors.items():
        for noun_name, noun in nouns.items():
            for one in [load_set for body, load_set in noun.load_sets() if body == name]:
                if one not in deck.loads:
                    text = f"found {one!r}, which is no set of loads of {deck.name}; {suggestion_text(one, deck.loads)}"
                    raise CaseError(case.path.name, [Problem(f"{heading}.{noun_name}.load_set", text)])
                sets[one] = deck.loads[one]
    return sets


def deck_members(deck: Deck, members: list[Member]) -> list[Member]:
    """The members of the case, after those of the deck whose cells they do not cover completely."""
    covered: dict[str, set[int]] = {}
    for member in members:
        for kind, rows in deck.mesh.cell_groups.get(member.group, {}).items():
            covered.setdefault(kind, set()).update(int(row) for row in rows)
    retained = []
    for member in deck.members:
        cells = deck.mesh.cell_groups.get(member.group, {})
        if cells and all(set(map(int, rows)) <= covered.get(kind, set()) for kind, rows in cells.items()):
            continue
        retained.append(member)
    return [*retained, *members]


def refined_members(mesh: Mesh, members: Iterable[Member]) -> list[Member]:
    """The members on a mesh that may have been refined: child elements take the values of their parent."""
    refined = []
    for member in members:
        cells = mesh.cell_groups.get(member.group, {})
        options = {name: _refined_option(value, cells) for name, value in member.options.items()}
        refined.append(replace(member, options=options))
    return refined


def _refined_option(value: Any, cells: Mapping[str, IntArray]) -> Any:
    if isinstance(value, tuple):
        return tuple(_refined_option(entry, cells) for entry in value)
    if not isinstance(value, Mapping):
        return value
    refined = {}
    for kind, values in value.items():
        while len(values) < len(cells.get(kind, ())):
            values = refined_values(kind, values)
        refined[kind] = values
    return refined


def left_out_text(deck: Deck) -> tuple[str, ...]:
    """Notes on the cards that the structure is built without, if any, and the notes of reading.

    Cards whose stiffness, mass or fluid is missing are listed in full.
    """
    missing = tuple(str(cards) for cards in deck.unused if "missing" in cards.consequence)
    kinds: dict[str, int] = {}
    for cards in deck.unused:
        if "missing" not in cards.consequence:
            kinds[cards.card] = kinds.get(cards.card, 0) + cards.count
    if not kinds:
        return (*deck.notes, *missing)
    listed = ", ".join(f"{count} {card}" for card, count in kinds.items())
    return (*deck.notes, *missing, f"left out of {deck.name}: {listed}; femflex info says what each changes")
