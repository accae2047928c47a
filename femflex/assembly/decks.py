"""Decks of bodies: read once, and put in the place of mesh, members and clamps that a body's table would give."""

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
from femflex.case.mesh_groups import groups_named
from femflex.case.problems import CaseError, Problem, near
from femflex.case.shape import MarkerTable
from femflex.case.support import DIRECTIONS, SkewSupport
from femflex.decks import Deck, read_deck
from femflex.fem import Member, Support
from femflex.fem.support import GLOBAL
from femflex.mesh import Mesh
from femflex.mesh.refine import refined_values

IN_FORCE = "supports"  # in a clamp: the supports that the deck's case control chooses
HELD_BY_ITSELF = "autospc"
ALL_OF = "all of {}"  # group of all nodes of a set of supports


def deck_of(case: Case, name: str, table: FlexibleTable) -> Deck | None:
    """The deck of a body, with groups for the nodes that its table names; None where it has a mesh.

    Raises CaseError with what is wrong with the deck.
    """
    if table.deck is None:
        return None
    path = case.path.parent / table.deck
    try:
        stamp = path.stat().st_mtime_ns if path.is_file() else 0
        found = _read(str(path), stamp, table.units, json.dumps(table.overrides, sort_keys=True))
        found = found.with_node_groups(group for _, group in groups_named("", table))
        return replace(found, mesh=found.mesh.with_groups(points=_supports_with_joints(case, name, found)))
    except (ValueError, OSError) as error:
        raise CaseError(case.path.name, [Problem(f"bodies.{name}.deck", str(error))]) from None


def _supports_with_joints(case: Case, name: str, deck: Deck) -> dict[str, list[int]]:
    """Group -> its points, all that a set of supports holds, of sets that joints name as markers."""
    ends = [(joint.child, joint.child_marker) for joint in case.joints]
    ends += [(joint.parent, joint.parent_marker) for joint in case.joints if joint.parent is not None]
    sets = {IN_FORCE: deck.active_supports(), **deck.supports}
    points = {}
    for marker in dict.fromkeys(marker for body, marker in ends if body == name and marker in sets):
        if marker not in deck.mesh.groups:
            groups = [group for group in sets[marker] if not group.startswith(HELD_BY_ITSELF)]
            points[ALL_OF.format(marker)] = sorted({int(p) for g in groups for p in deck.mesh.group_points(g)})
    return {group: rows for group, rows in points.items() if rows}


@lru_cache(maxsize=4)
def _read(path: str, stamp: int, units: str, overrides: str) -> Deck:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the trial by which loose components are found
        return read_deck(Path(path), units, json.loads(overrides))


def with_deck(case: Case, name: str, table: FlexibleTable) -> FlexibleTable:
    """The table with names of the deck's sets of supports in its clamp replaced by the groups they hold.

    "supports" stands for those in force in the deck. Components that nothing resists are fixed with any clamp.
    """
    deck = deck_of(case, name, table)
    r = table.reduction
    clamp: Mapping[str, tuple[str, ...] | SkewSupport] = getattr(r, "clamp", {})
    if deck is None or r is None or not clamp:
        return table
    held: dict[str, tuple[str, ...] | SkewSupport] = {}
    loose = HELD_BY_ITSELF in deck.supports and not any(one.startswith(HELD_BY_ITSELF) for one in clamp)
    for group, value in {**clamp, **({HELD_BY_ITSELF: ()} if loose else {})}.items():
        if group == IN_FORCE and group not in deck.mesh.groups:
            if not deck.default_supports:
                text = (
                    f"found 'supports', and case control of {deck.name} names no set of supports; its sets are "
                    f"{sorted(deck.supports) or 'none'}"
                )
                raise CaseError(case.path.name, [Problem(f"bodies.{name}.reduction.clamp", text)])
            held |= {one: _clamp(support) for one, support in deck.active_supports().items()}
        elif group in deck.supports and not value:
            held |= {one: _clamp(support) for one, support in deck.supports[group].items()}
        elif group in deck.mesh.groups:
            held[group] = value
        else:
            text = f"found {group!r}; {near(group, [*deck.supports, IN_FORCE, *deck.mesh.groups])}"
            raise CaseError(case.path.name, [Problem(f"bodies.{name}.reduction.clamp", text)])
    sets = [group for group in clamp if ALL_OF.format(group) in deck.mesh.groups and group not in table.markers]
    markers = {group: MarkerTable(group=ALL_OF.format(group)) for group in sets}
    return table.model_copy(
        update={"reduction": r.model_copy(update={"clamp": held}), "markers": {**table.markers, **markers}}
    )


def _clamp(support: Support) -> tuple[str, ...] | SkewSupport:
    if support.axes == GLOBAL:
        return () if set(support.components) == set(DIRECTIONS) else support.components
    return SkewSupport("axes", support.components, support.axes)


def deck_members(deck: Deck, own: list[Member]) -> list[Member]:
    """The members of a deck, those left out whose cells a member of the case covers, and the case's."""
    covered: dict[str, set[int]] = {}
    for member in own:
        for kind, rows in deck.mesh.cell_groups.get(member.group, {}).items():
            covered.setdefault(kind, set()).update(int(row) for row in rows)
    kept = []
    for member in deck.members:
        cells = deck.mesh.cell_groups.get(member.group, {})
        if cells and all(set(map(int, rows)) <= covered.get(kind, set()) for kind, rows in cells.items()):
            continue
        kept.append(member)
    return [*kept, *own]


def refined_members(mesh: Mesh, members: Iterable[Member]) -> list[Member]:
    """The members on a mesh that may have been refined since: values by element are those of their children."""
    found = []
    for member in members:
        own = mesh.cell_groups.get(member.group, {})
        options = {name: _refined(value, own) for name, value in member.options.items()}
        found.append(replace(member, options=options))
    return found


def _refined(value: Any, cells: Mapping[str, IntArray]) -> Any:
    if isinstance(value, tuple):
        return tuple(_refined(one, cells) for one in value)
    if not isinstance(value, Mapping):
        return value
    found = {}
    for kind, given in value.items():
        while len(given) < len(cells.get(kind, ())):
            given = refined_values(kind, given)
        found[kind] = given
    return found


def left_out_text(deck: Deck) -> tuple[str, ...]:
    """A line on the cards that the structure is made without, if any, those in full whose stiffness, mass or fluid is
    missing, and the notes of reading."""
    kinds: dict[str, int] = {}
    for one in deck.unused:
        kinds[one.card] = kinds.get(one.card, 0) + one.count
    if not kinds:
        return deck.notes
    listed = ", ".join(f"{count} {card}" for card, count in kinds.items())
    missing = tuple(str(one) for one in deck.unused if "missing" in one.consequence)
    return (*deck.notes, *missing, f"left out of {deck.name}: {listed}; femflex info says what each changes")
