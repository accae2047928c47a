"""Numbered nodes and elements of a deck as blocks of cells, with the sets of elements as groups."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.contents import Block
from femflex.mesh.numbers import Numbers

MISSING = 0  # in place of the number of a node: a middle node that the deck leaves out


class Numbered(NamedTuple):
    """One element: meshio's cell name, its number, and the numbers of its nodes in meshio's order."""

    cell: str
    number: int
    nodes: Sequence[int]


def blocks_of(elements: Sequence[Numbered], nodes: Mapping[int, int], sets: Mapping[str, Numbers]) -> list[Block]:
    """One block for every type of cell, in order of appearance; groups from the sets of element numbers.

    nodes: number -> row of the points; missing middle nodes become -1 (see midside.py).
    """
    by_cell: dict[str, list[Numbered]] = {}
    for element in elements:
        by_cell.setdefault(element.cell, []).append(element)
    known = {element.number for element in elements}
    listed = {name: np.array(members.among(known), np.int64) for name, members in sets.items()}
    rows = {**nodes, MISSING: -1} if MISSING not in nodes else dict(nodes)
    blocks = []
    for cell, mine in by_cell.items():
        numbers = np.array([element.number for element in mine], np.int64)
        connected = np.array([[rows[n] for n in element.nodes] for element in mine], np.int64)
        groups = {name: np.flatnonzero(np.isin(numbers, inside)) for name, inside in listed.items()}
        blocks.append(Block(cell, connected, {name: rows for name, rows in groups.items() if len(rows)}))
    return blocks


def require_nodes(
    elements: Sequence[Numbered],
    nodes: Mapping[int, int],
    where: str,
    card: str,
    label: Callable[[int, int], str] = lambda number, element: str(number),
) -> None:
    """Raise ValueError where elements use nodes that the deck does not define.

    card: what defines one;  label: how the deck calls a number that an element uses, or its own
    """
    unknown = sorted({n for element in elements for n in element.nodes} - nodes.keys() - {MISSING})
    if not unknown:
        return
    users = {n: element for element in reversed(elements) for n in element.nodes}
    user = users[unknown[0]]
    named = ", ".join(label(n, users[n].number) for n in unknown[:10])
    more = f" and {len(unknown) - 10} more" if len(unknown) > 10 else ""
    raise ValueError(
        f"{where}: elements use nodes [{named}]{more} that no {card} defines; the first is used by element "
        f"{label(user.number, user.number)} ({CELL_TYPES[user.cell].shape}). Add the nodes, or the file that holds "
        "them."
    )
