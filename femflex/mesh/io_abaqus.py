"""Abaqus (and CalculiX) input .inp: groups are ELSET and NSET, also those given by *NODE, *ELEMENT and sets of sets.

meshio forgets all but the last *NODE block, mixes up sets of several *ELEMENT blocks, knows few element types and
leaves the middle node of B32 in the middle. So keywords and sets are read here and meshio is given one plain deck.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.mesh.abaqus_elements import ELEMENTS, WRITTEN
from femflex.mesh.abaqus_keywords import Keyword, read_keywords
from femflex.mesh.contents import Block, Contents
from femflex.mesh.formats import WriteOptions, load_meshio, meshio_speaking, register
from femflex.mesh.mesh import Mesh
from femflex.mesh.numbers import Numbers

Array = NDArray[np.float64]
Index = NDArray[np.int64]

NAME = "Abaqus input"
END_MIDDLE_END = [0, 2, 1]  # B32 and T3D3 name their middle node second
IDS_PER_LINE = 12  # Abaqus allows 16
Element = tuple[str, int, list[int]]  # plain type, number, nodes


def read(path: Path) -> Contents:
    """Contents of a deck."""
    keywords = read_keywords(path)
    _refuse_assemblies(keywords, path)
    nodes: dict[int, list[str]] = {}
    elements: list[Element] = []
    left_out: Counter[str] = Counter()
    sets = {"NSET": _Sets("NSET"), "ELSET": _Sets("ELSET")}
    for keyword in keywords:
        if keyword.name == "NODE":
            new = {int(row[0]): [*row[1:4], "0", "0"][:3] for row in keyword.data}
            nodes |= {number: [x or "0" for x in xyz] for number, xyz in new.items()}
            sets["NSET"].add(keyword.parameter("nset"), list(new))
        elif keyword.name == "ELEMENT":
            mine, skipped = _elements(keyword, path)
            elements += mine
            if skipped:
                left_out[keyword.parameter("type").upper()] += skipped
            sets["ELSET"].add(keyword.parameter("elset"), [number for _, number, _ in mine])
        elif keyword.name in sets:
            _read_set(keyword, sets, elements)
    if not nodes:
        raise ValueError(f"{path.name} has no *NODE block; it is no Abaqus input with a mesh.")
    missing = {node for _, _, connected in elements for node in connected} - nodes.keys()
    if missing:
        raise ValueError(f"{path.name}: elements use nodes {sorted(missing)[:10]} that no *NODE block defines.")
    elements.sort(key=lambda e: e[0])
    raw = _through_meshio(nodes, elements, path)
    blocks = _blocks(raw, elements, sets["ELSET"].members)
    order = {number: k for k, number in enumerate(nodes)}
    point_groups = {
        group: np.array([order[n] for n in numbers.among(order)], np.int64)
        for group, numbers in sets["NSET"].members.items()
    }
    known = tuple(sets["ELSET"].members)
    return Contents(raw.points, blocks, point_groups, empty=known, left_out=left_out)


def write(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a flat deck of *NODE, *ELEMENT, *ELSET and *NSET; names Abaqus would not take bare are quoted."""
    unknown = sorted(set(mesh.cells) - set(WRITTEN))
    if unknown:
        raise ValueError(f"Abaqus has no element for cells of type {unknown}; write {path.stem}.msh or .vtu instead.")
    cells = [(c, nodes[:, END_MIDDLE_END] if c == "line3" else nodes) for c, nodes in mesh.cells.items()]
    text = io.StringIO()
    with meshio_speaking(path, NAME, "written"):
        load_meshio().abaqus.write(text, load_meshio().Mesh(mesh.points, cells))
    deck = text.getvalue()
    for ours, theirs in (WRITTEN[cell] for cell in mesh.cells):
        deck = deck.replace(f"*ELEMENT, TYPE={theirs}\n", f"*ELEMENT, TYPE={ours}\n")
    first = dict(zip(mesh.cells, np.cumsum([1, *map(len, mesh.cells.values())]), strict=False))
    for group, by_type in mesh.cell_groups.items():
        numbers = [rows + first[cell] for cell, rows in by_type.items()]
        deck += _set_lines("ELSET", group, np.concatenate([np.empty(0, np.int64), *numbers]))
    for group, rows in mesh.point_groups.items():
        deck += _set_lines("NSET", group, rows + 1)
    path.write_text(deck, encoding="utf-8")


class _Sets:
    """Numbers by set name while a deck is read; Abaqus does not tell capitals from small letters."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._parts: dict[str, list[int | range]] = {}
        self._spelling: dict[str, str] = {}

    @property
    def members(self) -> dict[str, Numbers]:
        """Numbers of every set."""
        return {name: Numbers(tuple(parts)) for name, parts in self._parts.items()}

    def add(self, name: str, numbers: Sequence[int | range]) -> None:
        """Add numbers and ranges to a set, new or known; a name of "" is none."""
        if name:
            self._parts.setdefault(self._spelling.setdefault(name.upper(), name), []).extend(numbers)

    def named(self, name: str) -> list[int | range]:
        """Numbers and ranges of a known set."""
        key = name.rsplit(".", 1)[-1].upper()  # part.set
        if key not in self._spelling:
            raise ValueError(f"{self.kind} {name!r} is used before it is defined; known are {sorted(self._parts)}.")
        return list(self._parts[self._spelling[key]])


def _refuse_assemblies(keywords: list[Keyword], path: Path) -> None:
    """One part in place is as good as a flat deck; more would need their nodes renumbered and moved."""
    instances = [k for k in keywords if k.name == "INSTANCE"]
    parts = [k for k in keywords if k.name == "PART"]
    if len(parts) > 1 or len(instances) > 1 or any(k.data for k in instances):
        raise ValueError(
            f"{path.name} is an assembly of {len(parts)} parts and {len(instances)} instances, or moves them; only flat"
            " decks or one part in place are read. Let Abaqus write a flat one (noPartsInputFile=ON)."
        )
    made = sorted({k.name for k in keywords} & {"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"})
    if made:
        raise ValueError(
            f"{path.name} makes nodes or elements by *{', *'.join(made)}; only those written out are read."
        )


def _elements(keyword: Keyword, path: Path) -> tuple[list[Element], int]:
    """Elements of one block, and how many were left out because their type is not understood."""
    name = keyword.parameter("type").upper()
    plain, count = next(((p, n) for pattern, p, n in ELEMENTS if re.match(pattern, name)), ("", 0))
    if not plain:
        ends = [k for k, words in enumerate(keyword.data) if k == 0 or keyword.data[k - 1][-1] != ""]
        return [], len(ends)  # a line that ends in a comma goes on in the next
    elements, row = [], list[int]()
    for words in keyword.data:
        row += [int(word) for word in words if word]
        if len(row) <= count:
            continue  # goes on in the next line
        if len(row) > count + 1 + (plain in ("B31", "B32")):  # a beam may add a node for its orientation
            raise ValueError(
                f"{path.name}: element {row[0]} of type {name} has {len(row) - 1} nodes; it needs {count}."
            )
        connected = row[1 : count + 1]
        elements.append((plain, row[0], [connected[k] for k in END_MIDDLE_END] if plain == "B32" else connected))
        row = []
    if row:
        raise ValueError(f"{path.name}: element {row[0]} of type {name} has {len(row) - 1} nodes; it needs {count}.")
    return elements, 0


def _read_set(keyword: Keyword, sets: dict[str, _Sets], elements: list[Element]) -> None:
    """Add an *NSET or *ELSET: numbers, GENERATE triples, names of other sets, or the nodes of an ELSET."""
    mine, name = sets[keyword.name], keyword.parameter(keyword.name.lower())
    mine.add(name, [])
    if keyword.name == "NSET" and keyword.parameter("elset"):
        listed = Numbers(tuple(sets["ELSET"].named(keyword.parameter("elset"))))
        wanted = set(listed.among({number for _, number, _ in elements}))
        mine.add(name, sorted({node for _, number, nodes in elements if number in wanted for node in nodes}))
        return
    for row in keyword.data:
        words = [word for word in row if word]
        if "generate" in keyword.parameters:
            first, last, step = (int(word) for word in [*words, "1"][:3])
            mine.add(name, [range(first, last + 1, step)])
            continue
        for word in words:
            mine.add(name, [int(word)] if word.lstrip("-").isdigit() else mine.named(word))


def _through_meshio(nodes: dict[int, list[str]], elements: list[Element], path: Path) -> Any:
    """meshio mesh of a plain deck: one *NODE block, one *ELEMENT block per type."""
    lines = ["*NODE", *(f"{number}, {', '.join(xyz)}" for number, xyz in nodes.items())]
    for k, (plain, number, connected) in enumerate(elements):
        if k == 0 or elements[k - 1][0] != plain:
            lines.append(f"*ELEMENT, TYPE={plain}")
        lines.append(f"{number}, {', '.join(map(str, connected))}")
    with meshio_speaking(path, NAME):
        return load_meshio().abaqus.read(io.StringIO("\n".join([*lines, ""])))


def _blocks(raw: Any, elements: list[Element], members: dict[str, Numbers]) -> list[Block]:
    known = {number for _, number, _ in elements}
    listed = {group: numbers.among(known) for group, numbers in members.items()}
    blocks, start = [], 0
    for part in raw.cells:
        numbers = np.array([number for _, number, _ in elements[start : start + len(part.data)]])
        start += len(part.data)
        groups = {group: np.flatnonzero(np.isin(numbers, inside)) for group, inside in listed.items()}
        blocks.append(Block(part.type, part.data, {g: rows for g, rows in groups.items() if len(rows)}))
    return blocks


def _set_lines(keyword: str, name: str, numbers: Index) -> str:
    if '"' in name or "\n" in name or not name:
        raise ValueError(f"group name {name!r} cannot stand in an Abaqus deck; rename it.")
    label = name if re.fullmatch(r"[A-Za-z_][\w\-]*", name) else f'"{name}"'
    words = [str(n) for n in numbers]
    rows = [", ".join(words[k : k + IDS_PER_LINE]) for k in range(0, len(words), IDS_PER_LINE)]
    return "\n".join([f"*{keyword}, {keyword}={label}", *rows, ""])


register(NAME, (".inp",), read, write, memory=25.0)  # measured: 19
