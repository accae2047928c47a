"""CBEAM3: beams of three grid points, curved where the middle one lies off the line, as chains of straight elements."""

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
    mark_turning,
)
from femflex.decks.nastran.model import NastranModel


def read_three_node_beams(model: NastranModel) -> None:
    """Add the CBEAM3 of a deck to the model."""
    model.bulk.trying(lambda card: _beam(model, card), "CBEAM3")


def _beam(model: NastranModel, card: Card) -> None:
    """EID, PID, GA, GB, GC, X1 to X3 or G0, then offsets at the three grids and twists, which must be zero."""
    number, grids = card.integer(0), [card.integer(k) for k in (2, 3)]
    pid = card.integer(1, number)
    middle = card.integer(4, 0)
    named = [grids[0], *([middle] if middle else []), grids[1]]
    if not model.grids.require(named, card):
        return
    made = model.bars(pid)
    if made is None:
        return
    more = model.nonstructural(number)
    made = made.loaded(more)
    given = [k for k in range(8, 20) if card.has(k) and card.real(k) != 0]
    if given:
        raise ValueError(
            f"{card} has an offset or a twist in field {given[0] + 2}, which is not read; give CBEAM instead"
        )
    if principal(made.stations[0])[0]:
        raise ValueError(f"{made.card} has Iyz; give principal axes to {card}")
    v = bar_orientation(model, _as_bar(card), grids[0], model.grids.axes(grids[0]), None, "GGG")
    rows = [model.row(g) for g in named]
    if middle:
        rows = chain_of(model.build, *rows)
    places = [model.build.points[row] for row in rows]
    for k in range(len(rows) - 1):
        span = places[k + 1] - places[k]
        length = float(np.linalg.norm(span))
        if not length > 0:
            raise ValueError(f"{card} has no length between two of its grid points")
        bar_frame(span, v, card)  # refuses an orientation along the element
        options = {"orientation": tuple(float(x) for x in v / np.linalg.norm(v)), **bar_options(model, made, card)}
        key = ("bar", pid, direction_key(v / np.linalg.norm(v)), None, more)
        add_bar(model, card, pid, (rows[k], rows[k + 1]), key, bar_section(model, made, length), options, (), [])
    mark_turning(model, named)


def _as_bar(card: Card) -> Card:
    """The card with its orientation where CBEAM has it."""
    return Card(card.name, [*card.fields[:4], *card.fields[5:8]], card.place)
