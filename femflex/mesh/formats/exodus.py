"""Exodus II (.exo, .e, of Cubit, Sierra, MOOSE): blocks and side sets are groups of cells, node sets of points.

Blocks and sets without a name are called block_1, sideset_2 and nodeset_3.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

from femflex.arrays import IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import Block, Contents, without_repeated_cells
from femflex.mesh.formats.register import register
from femflex.mesh.formats.vtk_data import CELLS, Leaf, cells_of, leaf_contents
from femflex.mesh.formats.vtk_process import VtkError, read_leaves
from femflex.warning import PhysicsWarning

NAME = "Exodus"
UNNAMED = {"Element Blocks": "block", "Edge Blocks": "edges", "Face Blocks": "faces", "Side Sets": "sideset"}
NUMBER = "GlobalNodeId"  # name of VTK's array of node numbers


def read_exodus(path: Path) -> Contents:
    """Contents of a file; its blocks and sets share the points by the numbers of their nodes."""
    leaves = _leaves(path)
    flat = not any(CELL_TYPES[CELLS[k]].dimension == 3 for leaf in leaves for k in set(leaf["kinds"]) if k in CELLS)
    numbers = [np.asarray(leaf["point"].get(NUMBER, []), np.int64) for leaf in leaves]
    for leaf, node_numbers in zip(leaves, numbers, strict=True):
        if len(node_numbers) != len(leaf["points"]):
            raise ValueError("its nodes have no numbers")
    all_numbers, first = np.unique(np.concatenate([np.zeros(0, np.int64), *numbers]), return_index=True)
    points = np.concatenate([np.zeros((0, 3)), *(leaf["points"] for leaf in leaves)])[first]
    blocks: list[Block] = []
    point_groups: dict[str, IntArray] = {}
    left_out: Counter[str] = Counter()
    for leaf, node_numbers in zip(leaves, numbers, strict=True):
        kind, name = _kind_and_name(leaf["name"])
        rows = np.searchsorted(all_numbers, node_numbers)
        if kind == "Node Sets":
            point_groups[name] = rows[np.unique(cells_of(leaf).nodes)]
            continue
        contents = leaf_contents({**leaf, "cell": {}, "point": {}})
        for block in contents.blocks:
            # VTK reads an edge of three nodes as a triangle
            edge = kind == "Side Sets" and flat and block.cell == "triangle"
            cell = "line3" if edge else block.cell
            blocks.append(Block(cell, rows[block.nodes], {name: np.arange(len(block.nodes))}))
        if kind == "Element Blocks":
            left_out.update(contents.left_out)
    keys = [np.sort(block.nodes, axis=1) for block in blocks]
    return Contents(points, without_repeated_cells(blocks, keys), point_groups, left_out=left_out)


def _leaves(path: Path) -> list[Leaf]:
    """Blocks and sets of the file; only the blocks, with a warning, if VTK cannot read the sets."""
    try:
        return read_leaves("exodus", path)
    except VtkError:
        leaves = read_leaves("exodus blocks", path)
    warnings.warn(
        f"{path.name}: its side sets and node sets cannot be read by VTK; only its blocks are groups. Write the sets "
        "again, or name blocks",
        PhysicsWarning,
        stacklevel=3,
    )
    return leaves


def _kind_and_name(path: str) -> tuple[str, str]:
    """Kind and name of a block or set, from the path of its leaf, such as "Side Sets/Unnamed set ID: 2"."""
    kind, _, name = path.partition("/")
    match = re.match(r"Unnamed (?:block|set) ID: (\d+)", name)
    if not match:
        return kind, re.sub(r" ID: \d+.*$", "", name) or path
    return kind, f"{UNNAMED.get(kind, 'nodeset')}_{match[1]}"


register(NAME, (".exo", ".e", ".ex2"), read_exodus)
