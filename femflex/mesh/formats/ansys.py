"""Ansys archives (.cdb, by CDWRITE): components, element types, materials and real constants are groups.

These are called type_1 (number of the element type), mat_2 and real_3 (real constants or sections).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from femflex.mesh.formats.contents import Contents
from femflex.mesh.formats.element_blocks import NumberedElement, blocks_of, require_nodes
from femflex.mesh.formats.guards import check_count
from femflex.mesh.formats.numbers import Numbers
from femflex.mesh.formats.register import register

NAME = "Ansys archive"
LINES = {1, 3, 4, 8, 10, 11, 16, 20, 23, 24, 33, 44, 54, 59, 68, 160, 161, 167, 180, 188, 189, 288, 289}
SURFACES = {
    2, 13, 25, 28, 29, 35, 41, 42, 43, 53, 55, 57, 63, 67, 75, 77, 78, 79, 81, 82, 83, 91, 93, 99, 106, 108, 110, 118,
    121, 131, 132, 141, 143, 145, 146, 150, 151, 152, 153, 154, 157, 162, 163, 181, 182, 183, 223, 230, 233, 281, 292,
    293,
}  # fmt: skip
SOLIDS = {
    5, 30, 45, 46, 62, 64, 65, 69, 70, 72, 73, 80, 86, 87, 89, 90, 92, 95, 96, 97, 98, 107, 117, 119, 120, 122, 123,
    127, 128, 142, 147, 148, 164, 168, 185, 186, 187, 190, 191, 220, 221, 225, 226, 227, 231, 232, 236, 237, 239, 240,
    278, 279, 285, 291,
}  # fmt: skip
TETRAHEDRA = {72, 87, 92, 98, 119, 123, 127, 148, 168, 187, 221, 227, 232, 237, 240, 285, 291}
TRIANGLES = {2, 35, 146}  # of six nodes
MESHES = {0: 180, 2: 180, 4: 35, 6: 281, 8: 187, 10: 186}  # types like MESH200 by its KEYOPT(1) and the next
# Cells by the positions of their nodes in the list of an element; corners that the list repeats are named once.
BRICKS = (
    ("hexahedron", [0, 1, 2, 3, 4, 5, 6, 7], range(8, 20)),
    ("wedge", [0, 1, 2, 4, 5, 6], [8, 9, 11, 12, 13, 15, 16, 17, 18]),
    ("pyramid", [0, 1, 2, 3, 4], [8, 9, 10, 11, 16, 17, 18, 19]),
    ("tetra", [0, 1, 2, 4], [8, 9, 11, 16, 17, 18]),
)
SECOND_ORDER = {"hexahedron": "hexahedron20", "wedge": "wedge15", "pyramid": "pyramid13", "tetra": "tetra10",
                "quad": "quad8", "triangle": "triangle6"}  # fmt: skip


def read_ansys(path: Path) -> Contents:
    """Contents of an archive with its nodes (NBLOCK) and elements (EBLOCK, SOLID)."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    types, nodes = dict[int, int](), dict[int, tuple[float, float, float]]()
    elements, left_out = list[NumberedElement](), Counter[str]()
    sets: dict[str, dict[str, list[int]]] = {"ELEM": {}, "NODE": {}}
    for k, line in enumerate(lines):
        words = [word.strip().upper() for word in line.split(",")]
        if words[0] == "ET" and len(words) > 2:
            types[int(words[1])] = int(re.sub(r"\D", "", words[2]) or 0)
        elif words[0].startswith("KEYOP") and words[2:3] == ["1"] and types.get(int(words[1])) == 200:
            types[int(words[1])] = MESHES.get(int(words[3]) // 2 * 2, 200)
        elif words[0] == "NBLOCK":
            nodes |= _nodes(lines[k + 1 :])
        elif words[0] == "EBLOCK":
            if "SOLID" not in words:
                raise ValueError(f"{path.name}, line {k + 1}: EBLOCK without SOLID is not read; write it by CDWRITE.")
            _elements(lines[k + 1 :], types, elements, sets["ELEM"], left_out)
        elif words[0] == "CMBLOCK" and len(words) > 3 and words[2][:4] in sets:
            numbers = _integers(lines[k + 2 :], *_widths(lines[k + 1]), int(words[3].split("!")[0]))
            sets[words[2][:4]][words[1]] = [*_expanded(numbers)]
    if not elements and not left_out:
        raise ValueError(f"{path.name} holds no elements (EBLOCK); write it by CDWRITE.")
    row_of = {number: k for k, number in enumerate(nodes)}
    require_nodes(elements, row_of, path.name, "NBLOCK")
    members = {name: Numbers(tuple(numbers)) for name, numbers in sets["ELEM"].items()}
    point_groups = {
        name: np.array([row_of[n] for n in numbers if n in row_of], np.int64) for name, numbers in sets["NODE"].items()
    }
    points = np.array(list(nodes.values())).reshape(-1, 3)
    return Contents(points, blocks_of(elements, row_of, members), point_groups, left_out=left_out)


def _widths(line: str) -> tuple[int, int]:
    """Number and width of the whole numbers in a format such as (19i9)."""
    match = re.match(r"\s*\((\d+)i(\d+)", line, re.I)
    if not match or not int(match[1]) or not int(match[2]):
        raise ValueError(f"the line {line.strip()[:60]!r} is no format of whole numbers")
    return int(match[1]), int(match[2])


def _nodes(lines: Sequence[str]) -> dict[int, tuple[float, float, float]]:
    """Positions by number of the node; the numbers before them stand at the beginning of a line."""
    width = _widths(lines[0])[1]
    before = sum(int(count) * int(size) for count, size in re.findall(r"(\d+)i(\d+)", lines[0], re.I))
    real_width = int((re.search(r"e(\d+)", lines[0], re.I) or [0, 20])[1])
    positions = {}
    for line in lines[1:]:
        if not line[:width].strip().isdigit():
            break
        text = line[before:]
        x, y, z = (float(text[j * real_width : (j + 1) * real_width].strip() or 0.0) for j in range(3))
        positions[int(line[:width])] = x, y, z
    return positions


def _integers(lines: Sequence[str], per_line: int, width: int, count: int) -> list[int]:
    """The first `count` whole numbers of lines with so many in each."""
    numbers: list[int] = []
    for line in lines:
        if len(numbers) >= count:
            break
        words = [line[j : j + width].strip() for j in range(0, min(len(line.rstrip()), per_line * width), width)]
        numbers += [int(word) for word in words if word]
    return numbers[:count]


def _elements(
    lines: Sequence[str], types: dict[int, int], elements: list[NumberedElement], sets: dict[str, list[int]],
    left_out: Counter[str],
) -> None:  # fmt: skip
    """Add the elements of a block: MAT, TYPE, REAL, five more, the number of nodes, one more, its number, the nodes."""
    per_line, width = _widths(lines[0])
    k = 1
    while k < len(lines):
        head = _integers(lines[k : k + 1], per_line, width, 11)
        if len(head) < 11:  # -1 ends the block
            return
        rows = max(1, -(-(11 + head[8]) // per_line))
        listed = _integers(lines[k : k + rows], per_line, width, 11 + head[8])[11:]
        k += rows
        kind = types.get(head[1], 0)
        cell, order = _cell(kind, listed)
        if not cell:
            left_out[f"Ansys {kind} of {len(listed)} nodes"] += 1
            continue
        elements.append(NumberedElement(cell, head[10], [listed[j] if j < len(listed) else 0 for j in order]))
        for prefix, number in zip(("mat", "type", "real"), head, strict=False):
            sets.setdefault(f"{prefix}_{number}", []).append(head[10])


def _cell(kind: int, nodes: Sequence[int]) -> tuple[str, Sequence[int]]:
    """Cell of an element of this type and the positions of its nodes in the list; "" for other elements."""
    n = len(nodes)
    if kind in LINES and n >= 2:
        return ("line3", [0, 1, 2]) if kind in (189, 289) else ("line", [0, 1])  # a further node orients a beam
    if kind in SURFACES and 3 <= n <= 8:  # five nodes: a further one stands off the surface
        n_corners = 3 if n == 3 or (n == 6 and kind in TRIANGLES) else 4
        corners, middles = list(range(n_corners)), list(range(n_corners, 2 * n_corners) if n > 5 else ())
        if len(corners) == 4 and nodes[2] == nodes[3]:
            corners, middles = [0, 1, 2], middles and [4, 5, 7]
        cell = "triangle" if len(corners) == 3 else "quad"
    elif kind in SOLIDS and (kind in TETRAHEDRA or n in (4, 10)):
        cell, corners, middles = "tetra", [0, 1, 2, 3], list(range(4, 10)) if n > 4 else []
    elif kind in SOLIDS and n >= 8:
        distinct = list(dict.fromkeys(nodes[:8]))
        found = next((brick for brick in BRICKS if [nodes[j] for j in brick[1]] == distinct), None)
        if found is None:
            return "", []
        cell, corners, middles = found[0], found[1], list(found[2]) if n > 8 else []
    else:
        return "", []
    second = any(nodes[j] for j in middles if j < n)
    return (SECOND_ORDER[cell], [*corners, *middles]) if second else (cell, corners)


def _expanded(numbers: Sequence[int]) -> Iterator[int]:
    """The numbers of a component, in which a negative one ends a range."""
    for before, number in zip([0, *numbers], numbers, strict=False):
        check_count(-number - before, "CMBLOCK")
        yield from range(before + 1, -number + 1) if number < 0 else [number]


register(NAME, (".cdb",), read_ansys)
