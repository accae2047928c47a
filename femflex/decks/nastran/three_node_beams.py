"""CBEAM3: beams of three grid points, curved if the middle one lies off the line, as chains of straight elements."""

from __future__ import annotations

import numpy as np

from femflex.decks.arcs import chain_of
from femflex.decks.builder import direction_key
from femflex.decks.nastran.bar_properties import principal
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.line_elements import (
    add_bar,
    bar_frame,
    bar_options,
    bar_orientation,
    bar_section,
    mark_displaced_and_rotated,
)
from femflex.decks.nastran.model import NastranModel


def read_three_node_beams(model: NastranModel) -> None:
    """Add the CBEAM3 of a deck to the model."""
    model.bulk.for_each_card(lambda card: _beam(model, card), "CBEAM3")


def _beam(model: NastranModel, card: Card) -> None:
    """Fields: EID, PID, GA, GB, GC, X1 to X3 or G0, then offsets at the three grids and twists, which must be zero."""
    number, grids = card.integer(0), [card.integer(k) for k in (2, 3)]
    pid = card.integer(1, number)
    middle = card.integer(4, 0)
    all_grids = [grids[0], *([middle] if middle else []), grids[1]]
    if not model.grids.require(all_grids, card):
        return
    bar = model.bars(pid)
    if bar is None:
        return
    extra_mass = model.nonstructural(number)
    bar = bar.with_added_mass(extra_mass)
    offset_fields = [k for k in range(8, 20) if card.has(k) and card.real(k) != 0]
    if offset_fields:
        raise ValueError(
            f"{card} has an offset or a twist in field {offset_fields[0] + 2}, which is not read; give CBEAM instead"
        )
    if principal(bar.stations[0])[0]:
        raise ValueError(f"{bar.card} has Iyz; give principal axes to {card}")
    v = bar_orientation(model, _as_bar(card), grids[0], model.grids.axes(grids[0]), None, "GGG")
    rows = [model.row(g) for g in all_grids]
    if middle:
        rows = chain_of(model.build, *rows)
    positions = [model.build.points[row] for row in rows]
    for k in range(len(rows) - 1):
        span = positions[k + 1] - positions[k]
        length = float(np.linalg.norm(span))
        if not length > 0:
            raise ValueError(f"{card} has no length between two of its grid points")
        bar_frame(span, v, card)  # raises ValueError for an orientation along the element
        options = {"orientation": tuple(float(x) for x in v / np.linalg.norm(v)), **bar_options(model, bar, card)}
        key = ("bar", pid, direction_key(v / np.linalg.norm(v)), None, extra_mass)
        add_bar(model, card, pid, (rows[k], rows[k + 1]), key, bar_section(model, bar, length), options, (), [])
    mark_displaced_and_rotated(model, all_grids)


def _as_bar(card: Card) -> Card:
    """The card with its orientation in the fields of CBEAM."""
    return Card(card.name, [*card.fields[:4], *card.fields[5:8]], card.location)
