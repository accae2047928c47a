"""Exodus II (.exo, .e, of Cubit, Sierra, MOOSE): blocks and side sets are groups of cells, node sets of points.

Blocks and sets without a name are called block_1, sideset_2 and nodeset_3. The file is in netCDF's classic format,
or in HDF5.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import IntArray
from femflex.hdf5 import open_hdf5
from femflex.mesh.cells import CELL_TYPES, side_of
from femflex.mesh.formats.contents import Block, Contents, without_repeated_cells
from femflex.mesh.formats.nastran_cards import ORDER
from femflex.mesh.formats.register import register

NAME = "Exodus"
ELEMENTS = {  # beginnings of the type of a block -> cell by number of nodes
    ("HEX",): {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"},
    ("TET",): {4: "tetra", 10: "tetra10"},
    ("WED", "PRI"): {6: "wedge", 15: "wedge15"},
    ("PYR",): {5: "pyramid", 13: "pyramid13"},
    ("QUA", "SHE", "TRI"): {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"},
    ("BAR", "BEA", "TRU", "EDG"): {2: "line", 3: "line3"},
    ("SPH", "CIR", "NOD"): {1: "vertex"},
}
BRICK27 = [*ORDER["hexahedron20"], 23, 24, 25, 26, 21, 22, 20]  # the centre comes first of the nodes on faces
SIDES: dict[str, list[tuple[int, ...]]] = {  # corners by number of the side, which is counted from 1
    "tetra": [(0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)],
    "hexahedron": [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)],
    "wedge": [(0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)],
    "pyramid": [(0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 3), (0, 3, 2, 1)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "triangle": [(0, 1), (1, 2), (2, 0)],
}
Variables = Mapping[str, NDArray[Any]]


def read_exodus(path: Path) -> Contents:
    """Contents of a file; the edges and faces that are blocks of their own are left out."""
    variables, types = _variables(path)
    axes = [variables[name] for name in ("coordx", "coordy", "coordz") if name in variables]
    points = np.column_stack(axes or [*variables["coord"]])
    blocks, left_out = list[Block](), Counter[str]()
    elements: list[tuple[Block, bool] | None] = []  # of every element its block, and whether that is of shells in space
    starts = list[int]()
    for k, name in _names(variables, "eb", "block"):
        if f"connect{k}" not in variables:
            continue
        nodes, word = np.asarray(variables[f"connect{k}"], np.int64) - 1, types.get(f"connect{k}", "").upper()
        cells = next((cells for words, cells in ELEMENTS.items() if word.startswith(words)), dict[int, str]())
        cell = cells.get(nodes.shape[1], "")
        block = Block(cell, nodes[:, BRICK27 if cell == "hexahedron27" else ORDER.get(cell, slice(None))])
        starts += [len(elements)] * len(nodes)
        in_space = points.shape[1] == 3 and not word.startswith("QUA")
        elements += [(block, in_space) if cell else None] * len(nodes)
        if cell:
            blocks.append(Block(cell, block.nodes, {name: np.arange(len(nodes))}))
        else:
            left_out[f"{word or 'of no type'} of {nodes.shape[1]} nodes"] += len(nodes)
    for k, name in _names(variables, "ss", "sideset"):
        sides = zip(variables.get(f"elem_ss{k}", ()), variables.get(f"side_ss{k}", ()), strict=True)
        by_cell: dict[str, list[IntArray]] = {}
        for element, side in ((int(element) - 1, int(side) - 1) for element, side in sides):
            if not 0 <= element < len(elements) or side < 0:
                raise ValueError(f"side set {name} names element {element + 1}, and there are {len(elements)}")
            if (owner := elements[element]) is not None and (
                found := _side_cell(*owner, element - starts[element], side)
            ):
                by_cell.setdefault(found[0], []).append(found[1])
        blocks += [Block(cell, np.array(rows), {name: np.arange(len(rows))}) for cell, rows in by_cell.items()]
    point_groups = {
        name: np.asarray(variables[f"node_ns{k}"], np.int64) - 1
        for k, name in _names(variables, "ns", "nodeset") if f"node_ns{k}" in variables
    }  # fmt: skip
    keys = [np.sort(block.nodes, axis=1) for block in blocks]
    return Contents(points, without_repeated_cells(blocks, keys), point_groups, left_out=left_out)


def _side_cell(block: Block, in_space: bool, row: int, side: int) -> tuple[str, IntArray] | None:
    """Cell and nodes of a side of an element; a shell in space has its two faces before its edges."""
    kind = CELL_TYPES[block.cell]
    sides: Sequence[tuple[int, ...]] = SIDES.get(kind.shape, [])
    if kind.dimension == 2 and in_space:
        sides = [tuple(range(kind.n_corners)), tuple(reversed(range(kind.n_corners))), *sides]
    if side >= len(sides):
        return None
    cell, local = side_of(kind, sides[side])
    return cell, block.nodes[row][local]


def _names(variables: Variables, kind: str, word: str) -> list[tuple[int, str]]:
    """Position from 1 and name of every block or set of a kind (eb, ss, ns); without a name by its number."""
    numbers = variables.get(f"{kind}_prop1", np.zeros(0, int)).tolist()
    rows = variables.get(f"{kind}_names", [b""] * len(numbers))
    names = [b"".join(np.atleast_1d(row).tolist()).split(b"\0")[0].decode("utf-8", "replace").strip() for row in rows]
    names += [""] * (len(numbers) - len(names))
    return [(k, name or f"{word}_{number}") for k, (number, name) in enumerate(zip(numbers, names, strict=False), 1)]


def _variables(path: Path) -> tuple[Variables, dict[str, str]]:
    """All arrays that describe the mesh, and the types of the elements of blocks, by name of their array."""
    wanted = re.compile(r"coord[xyz]?$|connect\d+$|(eb|ss|ns)_(prop1|names)$|(elem|side)_ss\d+$|node_ns\d+$")
    with open(path, "rb") as opened:
        classic = opened.read(3) == b"CDF"
    if not classic:
        with open_hdf5(path) as file:
            items = {name: item for name, item in file.items() if wanted.match(name)}
            types = {name: item.attrs["elem_type"] for name, item in items.items() if "elem_type" in item.attrs}
            arrays = {name: np.asarray(item[()]) for name, item in items.items()}
    else:
        from scipy.io import netcdf_file

        with warnings.catch_warnings(), netcdf_file(path, mmap=False) as file:
            items = {name: item for name, item in file.variables.items() if wanted.match(name)}
            types = {name: item.elem_type for name, item in items.items() if hasattr(item, "elem_type")}
            arrays = {name: np.array(item.data, item.data.dtype.newbyteorder("=")) for name, item in items.items()}
    return arrays, {name: word.decode() if isinstance(word, bytes) else str(word) for name, word in types.items()}


register(NAME, (".exo", ".e", ".ex2"), read_exodus)
