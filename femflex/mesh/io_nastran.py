"""Nastran bulk data (.bdf, .nas, .dat): groups are property ids and SETs of nodes or elements.

Nastran numbers them; names come from the caller's mapping or from the comments HyperMesh and Femap write, which are
also written here. meshio keeps no groups, fails without BEGIN BULK, on orientation angles and on most negative
coordinates, so the deck is read into cards first and meshio is given a plain one.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.mesh.contents import Block, Contents
from femflex.mesh.formats import load_meshio, meshio_speaking, register
from femflex.mesh.nastran_cards import NAME, Deck, listed, read_deck
from femflex.mesh.nastran_write import write

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Card -> numbers of nodes it may have, and its name in the plain deck.
ELEMENTS: dict[str, tuple[tuple[int, ...], str]] = {
    **dict.fromkeys(("CBAR", "CBEAM", "CROD", "CTUBE", "CONROD"), ((2,), "CBAR")),
    **dict.fromkeys(("CTRIA3", "CTRIAR"), ((3,), "CTRIA3")),
    **dict.fromkeys(("CQUAD4", "CQUADR", "CSHEAR"), ((4,), "CQUAD4")),
    "CTRIA6": ((6,), "CTRIA6"),
    "CQUAD8": ((8,), "CQUAD8"),
    "CTETRA": ((4, 10), "CTETRA"),
    "CPENTA": ((6, 15), "CPENTA"),
    **dict.fromkeys(("CPYRAM", "CPYRA"), ((5, 13), "CPYRA")),
    "CHEXA": ((8, 20), "CHEXA"),
}
OTHER_ELEMENTS = re.compile(
    r"(CAABSF|CBEND|CBEAM3|CBUSH|CDAMP|CELAS|CFAST|CGAP|CHACAB|CHBDY|CMASS|CONM|CPYRA|CQUAD|CRAC|CSEAM|CTRA?X|CTRIAX"
    r"|CVISC|CWELD|PLOTEL|RBAR|RBE|RJOINT|RROD|RSPLINE|RSSCON|RTRPLT)"
)


def read(path: Path) -> Contents:
    """Contents of a deck; groups are called pid_3 and set_4 where nothing names them."""
    deck = read_deck(path)
    grids = _grids(deck, path)
    elements, left_out = _elements(deck, path)
    unknown = {node for _, _, _, nodes in elements for node in nodes} - grids.keys()
    if unknown:
        raise ValueError(f"{path.name}: elements use grid points {sorted(unknown)[:10]} that no GRID card defines.")
    elements.sort(key=lambda e: (e[0], len(e[3])))  # one run of each type
    raw = _through_meshio(grids, elements, path)
    order = {number: k for k, number in enumerate(grids)}
    blocks, row_of = _blocks(raw, elements, order)
    point_groups = _sets(deck, order, row_of, blocks, path)
    titles = {f"set_{n}": name for n, (_, name) in deck.set_names.items() if n in deck.sets}
    titles |= {f"pid_{n}": name for n, name in deck.property_names.items() if name}
    for number in [n for n, name in deck.property_names.items() if not name]:  # written for cells in no group
        for block in blocks:
            block.groups.pop(f"pid_{number}", None)
    return Contents(raw.points, blocks, point_groups, titles=titles, left_out=left_out)


def _grids(deck: Deck, path: Path) -> dict[int, list[str]]:
    """Coordinates, as written, by grid number; only the basic coordinate system is understood."""
    default = next((f[1] for name, f in deck.cards if name == "GRDSET"), "")
    grids, elsewhere = {}, []
    for name, fields in deck.cards:
        if name == "GRID":
            if (fields[1] or default) not in ("", "0"):
                elsewhere.append(fields[0])
            grids[int(fields[0])] = [_number(word) for word in fields[2:5]]
    if elsewhere:
        raise ValueError(
            f"{path.name}: {len(elsewhere)} GRID cards, the first is {elsewhere[0]}, are given in a local coordinate "
            "system (field CP); only the basic system is read. Write the deck in basic coordinates."
        )
    if not grids:
        raise ValueError(f"{path.name} has no GRID cards; it is no Nastran bulk data with a mesh.")
    return grids


def _number(word: str) -> str:
    """A Nastran real (1.5-3, 2.D+4, blank) as Python writes it."""
    word = word.upper().replace("D", "E") or "0.0"
    return re.sub(r"(?<=[0-9.])([+-])", r"E\1", word) if "E" not in word else word


def _elements(deck: Deck, path: Path) -> tuple[list[tuple[str, int, int, list[int]]], Counter[str]]:
    """Elements (plain name, number, property, nodes) and the count of those not understood."""
    elements, left_out = [], Counter[str]()
    for name, fields in deck.cards:
        if name not in ELEMENTS:
            if OTHER_ELEMENTS.match(name):
                left_out[name] += 1
            continue
        counts, plain = ELEMENTS[name]
        start, pid = (1, 0) if name == "CONROD" else (2, int(fields[1] or fields[0]))
        words = fields[start : start + counts[-1]]
        words += [""] * (counts[-1] - len(words))
        given = [int(word) for word in words if word]
        if len(given) not in counts or "" in words[: len(given)]:
            raise ValueError(
                f"{path.name}: {name} {fields[0]} has {len(given)} nodes; it may have {' or '.join(map(str, counts))}. "
                "Elements with some mid-side nodes only are not read."
            )
        if deck.by_gmsh and name == "CBAR" and fields[4].isdigit():
            given.append(int(fields[4]))
        elements.append((plain, int(fields[0]), pid, given))
    return elements, left_out


def _through_meshio(grids: dict[int, list[str]], elements: list[tuple[str, int, int, list[int]]], path: Path) -> Any:
    """meshio mesh of a plain free-field deck: nothing but GRIDs and elements, one card per line."""
    lines = ["BEGIN BULK"]
    lines += [f"GRID,{number},,{','.join(xyz)}" for number, xyz in grids.items()]
    lines += [f"{name},{number},1,{','.join(map(str, nodes))}" for name, number, _, nodes in elements]
    with meshio_speaking(path, NAME):
        return load_meshio().nastran.read(io.StringIO("\n".join([*lines, "ENDDATA", ""])))


def _blocks(
    raw: Any, elements: list[tuple[str, int, int, list[int]]], order: dict[int, int]
) -> tuple[list[Block], dict[int, tuple[int, int]]]:
    """Blocks grouped by property, and where (block, row) an element number is."""
    blocks, row_of, start = [], dict[int, tuple[int, int]](), 0
    for k, part in enumerate(raw.cells):
        mine = elements[start : start + len(part.data)]
        start += len(part.data)
        row_of |= {number: (k, row) for row, (_, number, _, _) in enumerate(mine)}
        pids = np.array([pid for _, _, pid, _ in mine])
        groups = {f"pid_{pid}": np.flatnonzero(pids == pid) for pid in np.unique(pids) if pid}
        middles = [order[nodes[2]] for _, _, _, nodes in mine if part.type == "line" and len(nodes) == 3]
        if len(middles) == len(mine):
            blocks.append(Block("line3", np.column_stack([part.data, middles]), groups))
        else:
            blocks.append(Block(part.type, part.data, groups))
    return blocks, row_of


def _sets(
    deck: Deck, order: dict[int, int], row_of: dict[int, tuple[int, int]], blocks: list[Block], path: Path
) -> dict[str, Index]:
    """Point groups of the deck's SETs; those of elements are put into the blocks.

    A comment or a SET3 card says which; else a SET whose numbers are all grid points is one of points.
    """
    kinds = {number: kind for number, (kind, _) in deck.set_names.items()}
    sets = dict(deck.sets)
    for name, fields in deck.cards:
        if name == "SET1" and fields[0].isdigit():
            sets[int(fields[0])] = listed([w for w in fields[1:] if w.upper() != "SKIN"])
        elif name == "SET3" and fields[1].upper() in ("GRID", "ELEM", "ELEMENT"):
            sets[int(fields[0])] = listed(fields[2:])
            kinds[int(fields[0])] = "1" if fields[1].upper() == "GRID" else "2"
    point_groups: dict[str, Index] = {}
    for number, members in sets.items():
        kind = kinds.get(number) or ("1" if members.within(order) else "2")
        known = members.among(order if kind == "1" else row_of)
        if kind == "1":
            point_groups[f"set_{number}"] = np.array([order[m] for m in known], np.int64)
            continue
        rows: dict[int, list[int]] = {}
        for member in known:
            rows.setdefault(row_of[member][0], []).append(row_of[member][1])
        for k, block_rows in rows.items():
            blocks[k].groups[f"set_{number}"] = np.array(block_rows)
    return point_groups


register(NAME, (".bdf", ".nas", ".dat"), read, write, memory=25.0)  # measured: 16
