"""A deck as it was read, in lines of text: members, masses, connections, springs and supports, nodes by their numbers.

`PYTHONPATH=tests/decks python tests/decks/deck_texts.py` writes those of the decks that stand beside it anew.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from femflex.decks import Deck, read_deck
from femflex.decks.report import describe

HERE = Path(__file__).parents[1] / "decks"
UNITS = "mm-t-s"
DECKS = {"two_of_every_card": ".bdf", "two_of_every_keyword": ".inp"}
NOTHING = 1e-9  # what is smaller is rounding, or stands for a stiffness that is none


def text_of(deck: Deck) -> str:
    """All that a deck holds, and what is said of it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        said = describe(deck)
    return "\n".join([said, "", *_members(deck), *_connections(deck), *_supports(deck), *_groups(deck)]) + "\n"


def _members(deck: Deck) -> Iterable[str]:
    for member in deck.members:
        if member.group in deck.mesh.point_groups:
            listed = _nodes(deck, deck.mesh.group_points(member.group))
        else:
            cells = deck.mesh.group_cells(member.group)
            listed = "; ".join(f"{cell} {_cells(deck, nodes)}" for cell, nodes in cells.items())
        yield f"{member.family} {member.group}: {listed}"
        values = [*_parts(member.section), *_parts(member.material), *sorted(member.options.items())]
        yield "    " + ", ".join(f"{name} {_value(part)}" for name, part in values if part is not None)


def _parts(thing: Any) -> Iterable[tuple[str, Any]]:
    return [(one.name, getattr(thing, one.name)) for one in fields(thing)] if is_dataclass(thing) else []


def _connections(deck: Deck) -> Iterable[str]:
    for thing in (*deck.point_masses, *deck.connections, *deck.bushings):
        values = []
        for name, part in _parts(thing):
            if isinstance(part, str) and part in deck.mesh.groups:
                part = _nodes(deck, deck.mesh.group_points(part))
            elif name == "leaders":
                part = [_nodes(deck, deck.mesh.group_points(one)) for one in part]
            elif name == "terms":
                part = [(_nodes(deck, deck.mesh.group_points(group)), *rest) for group, *rest in part]
            values.append(f"{name} {_value(part)}")
        yield f"{type(thing).__name__}: {', '.join(values)}"


def _supports(deck: Deck) -> Iterable[str]:
    for name, held in deck.supports.items():
        for group, support in held.items():
            where = _nodes(deck, deck.mesh.group_points(group))
            yield f"support {name}: {where} {_value(support.components)} along {_value(support.axes)}"


def _groups(deck: Deck) -> Iterable[str]:
    parts = {member.group for member in deck.members}
    for name in sorted(set(deck.mesh.groups) - parts):
        yield f"group {name}: {_nodes(deck, deck.mesh.group_points(name))}"


def _nodes(deck: Deck, rows: Iterable[int]) -> str:
    number = {row: own for own, row in deck.points_of_ids.items()}
    return " ".join(str(number[row]) if row in number else _value(deck.mesh.points[row]) for row in rows)


def _cells(deck: Deck, nodes: np.ndarray) -> str:
    return ", ".join(_nodes(deck, row) for row in nodes)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + " ".join(f"{key} {_value(part)}" for key, part in value.items()) + "}"
    if isinstance(value, np.ndarray) or (isinstance(value, (tuple, list)) and value):
        return "(" + " ".join(_value(part) for part in value) + ")"
    if isinstance(value, float):
        return f"{value:.6g}" if abs(value) > NOTHING else "0"
    return str(value)


def known(name: str) -> str:
    """The text of a deck when it was last looked at."""
    return (HERE / f"{name}.txt").read_text(encoding="utf-8")


def read(name: str) -> Deck:
    """The deck of that name beside this file."""
    return read_deck(HERE / f"{name}{DECKS[name]}", UNITS)


if __name__ == "__main__":
    for one in DECKS:
        (HERE / f"{one}.txt").write_text(text_of(read(one)), encoding="utf-8")
