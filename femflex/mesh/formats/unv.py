"""Universal files (.unv, of Salome, I-DEAS, Simcenter): groups of dataset 2467 and its predecessors, property numbers.

Datasets 15, 781, 2411 (nodes), 780, 2412 (elements), 164 (units), 2417 to 2477 (groups).
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from femflex.mesh.formats.contents import Contents
from femflex.mesh.formats.element_blocks import NumberedElement, blocks_of, require_nodes
from femflex.mesh.formats.numbers import Numbers
from femflex.mesh.formats.register import register
from femflex.warning import PhysicsWarning

NAME = "universal file"
NODES = {"15": 1, "781": 2, "2411": 2}  # dataset -> lines of a node
ELEMENTS = ("780", "2412")
GROUPS = {"2417": 4, "2429": 4, "2430": 4, "2432": 4, "2435": 2, "2452": 2, "2467": 2, "2477": 2}  # entities a line
BEAMS = {11, 21, 22, 23, 24, 31, 32}  # descriptors of elements with an additional line for the orientation
NODE, ELEMENT = 7, 8  # kinds of entities of a group
# Descriptor of the element -> cell.
CELLS = {
    **dict.fromkeys((11, 21, 22, 31), "line"),
    **dict.fromkeys((23, 24, 32), "line3"),
    **dict.fromkeys((41, 51, 61, 71, 74, 81, 91), "triangle"),
    **dict.fromkeys((42, 52, 62, 72, 82, 92), "triangle6"),
    **dict.fromkeys((44, 54, 64, 84, 94), "quad"),
    **dict.fromkeys((45, 55, 65, 85, 95), "quad8"),
    **dict.fromkeys((111,), "tetra"),
    **dict.fromkeys((118,), "tetra10"),
    **dict.fromkeys((112,), "wedge"),
    **dict.fromkeys((113,), "wedge15"),
    **dict.fromkeys((115,), "hexahedron"),
    **dict.fromkeys((116,), "hexahedron20"),
    **dict.fromkeys((312,), "pyramid"),
}
# Universal files list the nodes around each face, corners and middles alternating: position of every node in that list.
ORDER = {
    "line3": [0, 2, 1],
    "triangle6": [0, 2, 4, 1, 3, 5],
    "quad8": [0, 2, 4, 6, 1, 3, 5, 7],
    "tetra10": [0, 2, 4, 9, 1, 3, 5, 6, 7, 8],
    "wedge15": [0, 2, 4, 9, 11, 13, 1, 3, 5, 10, 12, 14, 6, 7, 8],
    "hexahedron20": [0, 2, 4, 6, 12, 14, 16, 18, 1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11],
}


def read_unv(path: Path) -> Contents:
    """Contents of a file; groups without a name are called group_3, properties property_2."""
    nodes: dict[int, list[float]] = {}
    elements: list[NumberedElement] = []
    left_out: Counter[str] = Counter()
    metre = 1.0
    properties: dict[str, list[int]] = {}
    element_sets: dict[str, Numbers] = {}
    node_sets: dict[str, list[int]] = {}
    for number, lines in _datasets(path):
        if number in NODES:
            nodes |= _nodes(lines, NODES[number])
        elif number in ELEMENTS:
            _elements(lines, number, elements, properties, left_out)
        elif number in GROUPS:
            for name, points, cells in _groups(lines, GROUPS[number]):
                if points:
                    node_sets[name] = points
                if cells:
                    element_sets[name] = Numbers(tuple(cells))
        elif number == "164":
            metre = _metre(lines, path)
    if not nodes:
        raise ValueError(f"{path.name} has no nodes (dataset 15, 781 or 2411); it is no universal file with a mesh.")
    row_of = {number: k for k, number in enumerate(nodes)}
    require_nodes(elements, row_of, path.name, "dataset of nodes")
    sets = {name: Numbers(tuple(numbers)) for name, numbers in properties.items()} | element_sets
    point_groups = {
        name: np.array([row_of[n] for n in numbers if n in row_of], np.int64) for name, numbers in node_sets.items()
    }
    blocks = blocks_of(elements, row_of, sets)
    return Contents(
        np.array(list(nodes.values())) / metre, blocks, point_groups, empty=tuple(element_sets), left_out=left_out
    )


def _datasets(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Number and lines of every dataset; each is enclosed by lines of -1."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    marks = [k for k, line in enumerate(lines) if line.strip() == "-1"]
    if len(marks) < 2:
        raise ValueError(f"{path.name} has no datasets between lines of -1; it is no universal file.")
    for start, stop in zip(marks[::2], [*marks[1::2], len(lines)], strict=False):
        if start + 1 < stop:
            yield lines[start + 1].split()[0] if lines[start + 1].split() else "", lines[start + 2 : stop]


def _integers(line: str, what: str) -> list[int]:
    try:
        return [int(word) for word in line.split()]
    except ValueError:
        raise ValueError(f"the line {line.strip()[:60]!r} of {what} holds words that are no whole numbers") from None


def _nodes(lines: list[str], size: int) -> dict[int, list[float]]:
    """Positions by node number."""
    positions = {}
    for k in range(0, len(lines) - size + 1, size):
        words = " ".join(lines[k : k + size]).upper().replace("D", "E").split()
        if len(words) < 7:
            raise ValueError(f"the node of the line {lines[k].strip()[:60]!r} has {len(words) - 4} coordinates, not 3")
        positions[int(words[0])] = [float(word) for word in words[4:7]]
    return positions


def _elements(
    lines: list[str],
    dataset: str,
    elements: list[NumberedElement],
    properties: dict[str, list[int]],
    left_out: Counter[str],
) -> None:
    """Add the elements of a dataset, with their property numbers."""
    k = 0
    while k < len(lines):
        head = _integers(lines[k], "an element")
        if len(head) < 6:
            raise ValueError(f"the line {lines[k].strip()[:60]!r} of an element has {len(head)} numbers, not 6")
        number, kind, count = head[0], head[1], head[-1]
        prop = head[3] if dataset == "780" and len(head) > 6 else head[2]
        k += 2 if kind in BEAMS else 1
        numbers: list[int] = []
        while len(numbers) < count:
            if k >= len(lines):
                raise ValueError(f"element {number} has {len(numbers)} of its {count} nodes; the file is cut short")
            numbers += _integers(lines[k], f"element {number}")
            k += 1
        cell = CELLS.get(kind, "")
        if kind == 22 and count == 3:
            cell = "line3"
        if not cell or count != _size(cell):
            left_out[f"element {kind} of {count} nodes"] += 1
            continue
        elements.append(NumberedElement(cell, number, [numbers[j] for j in ORDER.get(cell, range(count))]))
        properties.setdefault(f"property_{prop}", []).append(number)


def _size(cell: str) -> int:
    from femflex.mesh.cells import CELL_TYPES

    return len(CELL_TYPES[cell].nodes)


def _groups(lines: list[str], per_line: int) -> Iterator[tuple[str, list[int], list[int]]]:
    """Name, numbers of nodes and numbers of elements of every group."""
    k = 0
    while k + 1 < len(lines):
        head = _integers(lines[k], "a group")
        count = head[-1] if head else 0
        name = re.sub(r"\s+", " ", lines[k + 1].strip()) or f"group_{head[0]}"
        k += 2
        width = 8 // per_line  # integers per entity: its kind and number, and two more in newer datasets
        numbers: list[int] = []
        while len(numbers) < width * count and k < len(lines):
            numbers += _integers(lines[k], f"group {name!r}")
            k += 1
        entities = np.array(numbers[: len(numbers) // width * width], np.int64).reshape(-1, width)
        points, cells = (entities[entities[:, 0] == kind, 1].tolist() for kind in (NODE, ELEMENT))
        yield name, points, cells


def _metre(lines: list[str], path: Path) -> float:
    """The length of a metre in the file's unit, by its dataset of units; warns where that is not 1."""
    words = " ".join(lines[1:]).upper().replace("D", "E").split()
    factor = float(words[0]) if words else 1.0
    if factor in (0.0, 1.0):
        return 1.0
    warnings.warn(
        f"{path.name}: by its dataset of units (164) a metre is {factor:g} of its lengths; the mesh is converted to "
        "metres. Give no mesh_unit in the case",
        PhysicsWarning,
        stacklevel=3,
    )
    return factor


register(NAME, (".unv",), read_unv)
