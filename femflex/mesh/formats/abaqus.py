"""Abaqus (and CalculiX) input .inp: groups are ELSET and NSET, also those defined by *NODE, *ELEMENT and sets of sets.

Parts are placed at their instances; if there are several instances, their sets are named INSTANCE.SET.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np

from femflex.arrays import IntArray
from femflex.mesh.formats.abaqus_elements import END_MIDDLE_END, WRITTEN_TYPES
from femflex.mesh.formats.abaqus_flat import FlatDeck, read_flat
from femflex.mesh.formats.contents import Contents
from femflex.mesh.formats.element_blocks import NumberedElement, blocks_of, require_nodes
from femflex.mesh.formats.register import WriteOptions, register
from femflex.mesh.mesh import Mesh

NAME = "Abaqus input"
IDS_PER_LINE = 12  # Abaqus allows 16


def read_abaqus(path: Path) -> Contents:
    """Contents of a deck."""
    return contents_of(read_flat(path), path.name)


def contents_of(flat: FlatDeck, source: str) -> Contents:
    """Contents of a deck that has been read as one model."""
    elements = [
        NumberedElement(element.cell, element.number, element.nodes)
        for element in flat.elements.values()
        if element.cell
    ]
    left_out = Counter(element.kind for element in flat.elements.values() if not element.cell)
    row_of = {number: k for k, number in enumerate(flat.nodes)}
    require_nodes(elements, row_of, source, "*NODE block", flat.label)
    sets = flat.elsets.members()
    point_groups = {
        group: np.array([row_of[n] for n in numbers.among(row_of)], np.int64)
        for group, numbers in flat.nsets.members().items()
    }
    points = np.array(list(flat.nodes.values()))
    return Contents(points, blocks_of(elements, row_of, sets), point_groups, empty=tuple(sets), left_out=left_out)


def write_abaqus(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a flat deck of *NODE, *ELEMENT, *ELSET and *NSET; names that Abaqus does not accept unquoted are quoted."""
    unknown = sorted(set(mesh.cells) - set(WRITTEN_TYPES))
    if unknown:
        raise ValueError(f"Abaqus has no element for cells of type {unknown}; write {path.stem}.msh or .vtu instead.")
    lines = ["*HEADING", " mesh written by femflex", "*NODE"]
    lines += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    first: dict[str, int] = {}
    number = 1
    for cell, nodes in mesh.cells.items():
        first[cell] = number
        lines.append(f"*ELEMENT, TYPE={WRITTEN_TYPES[cell]}")
        for row in (nodes[:, END_MIDDLE_END] if cell == "line3" else nodes).tolist():
            words = [str(number), *(str(n + 1) for n in row)]
            lines += [",".join(words[:16]) + ",", ",".join(words[16:])] if len(words) > 16 else [",".join(words)]
            number += 1
    for group, by_type in mesh.cell_groups.items():
        numbers = [rows + first[cell] for cell, rows in by_type.items()]
        lines += _set_lines("ELSET", group, np.concatenate([np.empty(0, np.int64), *numbers]))
    for group, rows in mesh.point_groups.items():
        lines += _set_lines("NSET", group, rows + 1)
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def _set_lines(keyword: str, name: str, numbers: IntArray) -> list[str]:
    if '"' in name or "\n" in name or not name:
        raise ValueError(f"group name {name!r} cannot stand in an Abaqus deck; rename it.")
    label = name if re.fullmatch(r"[A-Za-z_][\w\-]*", name) else f'"{name}"'
    words = [str(n) for n in numbers]
    rows = [", ".join(words[k : k + IDS_PER_LINE]) for k in range(0, len(words), IDS_PER_LINE)]
    return [f"*{keyword}, {keyword}={label}", *rows]


register(NAME, (".inp",), read_abaqus, write_abaqus, memory=25.0)
