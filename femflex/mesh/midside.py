"""Missing middle nodes of second-order cells, added at the middle of their edges."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.arrays import Array, BoolArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.contents import Block, Contents
from femflex.warning import PhysicsWarning


def with_middle_nodes(contents: Contents, source: str) -> Contents:
    """The contents with every middle node that is -1 in a block replaced.

    The replacement is the node of another cell between the same corners, or a new node at their middle. A warning gives
    the number of cells and of new nodes.
    """
    partial = [b for b in contents.blocks if b.cell in CELL_TYPES and _missing_nodes(b).any()]
    if not partial:
        return contents
    node_between: dict[frozenset[int], int] = {}
    for block in contents.blocks:
        kind = CELL_TYPES.get(block.cell)
        for column, parents in enumerate(kind.parents if kind else [], kind.n_corners if kind else 0):
            for corners, node in zip(block.nodes[:, parents].tolist(), block.nodes[:, column].tolist(), strict=True):
                if node >= 0:
                    node_between[frozenset(corners)] = node
    points: list[Array] = [np.asarray(contents.points, float)]
    n = first = len(points[0])
    completed = {}
    for block in partial:
        kind, nodes = CELL_TYPES[block.cell], block.nodes.copy()
        for row, extra in np.argwhere(_missing_nodes(block)):
            column = kind.n_corners + extra
            corners = nodes[row, kind.parents[extra]]
            key = frozenset(corners.tolist())
            if key not in node_between:
                node_between[key] = n
                points.append(points[0][corners].mean(axis=0, keepdims=True))
                n += 1
            nodes[row, column] = node_between[key]
        completed[id(block)] = replace(block, nodes=nodes)
    count = sum(int(_missing_nodes(block).any(axis=1).sum()) for block in partial)
    warnings.warn(
        f"{source}: {count} cells of second order have some middle nodes only; {n - first} nodes are added at the "
        "middle of their edges. Beside a neighbour of first order such a node follows the straight edge",
        PhysicsWarning,
        stacklevel=3,
    )
    blocks = [completed.get(id(block), block) for block in contents.blocks]
    return replace(contents, points=np.concatenate(points), blocks=blocks)


def _missing_nodes(block: Block) -> BoolArray:
    """Mask (n, k) of the nodes beyond the corners, true where a node is missing."""
    return np.asarray(block.nodes[:, CELL_TYPES[block.cell].n_corners :] == -1)
