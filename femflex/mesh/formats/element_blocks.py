"""Numbered elements of a deck, and their conversion to blocks of cells with element sets as groups."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import Block
from femflex.mesh.formats.numbers import Numbers

MISSING = 0  # node number of a middle node that is missing in the deck


class NumberedElement(NamedTuple):
    """One element: meshio's cell name, its number, and the numbers of its nodes in meshio's order."""

    cell: str
    number: int
    nodes: Sequence[int]


def blocks_of(
    elements: Sequence[NumberedElement], nodes: Mapping[int, int], sets: Mapping[str, Numbers]
) -> list[Block]:
    """One block for every type of cell, in order of appearance; groups from the sets of element numbers.

    nodes: number -> row of the points; missing middle nodes become -1 (see contents.py).
    """
    by_cell: dict[str, list[NumberedElement]] = {}
    for element in elements:
        by_cell.setdefault(element.cell, []).append(element)
    element_numbers = {element.number for element in elements}
    set_members = {name: np.array(members.among(element_numbers), np.int64) for name, members in sets.items()}
    rows = {**nodes, MISSING: -1} if MISSING not in nodes else dict(nodes)
    blocks = []
    for cell, same_cell in by_cell.items():
        numbers = np.array([element.number for element in same_cell], np.int64)
        connected = np.array([[rows[n] for n in element.nodes] for element in same_cell], np.int64)
        groups = {name: np.flatnonzero(np.isin(numbers, set_numbers)) for name, set_numbers in set_members.items()}
        blocks.append(Block(cell, connected, {name: rows for name, rows in groups.items() if len(rows)}))
    return blocks


def require_nodes(
    elements: Sequence[NumberedElement],
    nodes: Mapping[int, int],
    source: str,
    definition: str,
    label: Callable[[int, int], str] = lambda number, element: str(number),
) -> None:
    """Raise ValueError if elements use nodes that the deck does not define.

    definition  name of the card that defines a node
    label       text for a node number used by an element, or for the number of an element
    """
    unknown = sorted({n for element in elements for n in element.nodes} - nodes.keys() - {MISSING})
    if not unknown:
        return
    users = {n: element for element in reversed(elements) for n in element.nodes}
    user = users[unknown[0]]
    numbers_text = ", ".join(label(n, users[n].number) for n in unknown[:10])
    more_text = f" and {len(unknown) - 10} more" if len(unknown) > 10 else ""
    raise ValueError(
        f"{source}: elements use nodes [{numbers_text}]{more_text} that no {definition} defines; the first is used by "
        f"element {label(user.number, user.number)} ({CELL_TYPES[user.cell].shape}). Add the nodes, or the file that "
        "holds them."
    )
