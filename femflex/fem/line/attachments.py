"""Attachments of a line that is cut into segments: the segment of each point and cell of the other members."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import BoolArray, IntArray
from femflex.fem.line.path import AT_NODE, Path
from femflex.fem.structure import Member

if TYPE_CHECKING:
    from femflex.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Attachments:
    """The segment of each point (n_points,), -1 for points without a member, and the segments of the members' cells.

    cells  group -> cell type -> (rows of the mesh's cells, their segments)
    """

    nodes: IntArray
    cells: dict[str, dict[str, tuple[IntArray, IntArray]]]

    def cells_of(self, group: str, j: int) -> dict[str, IntArray]:
        """Indices (k,) of the cells of a member that go with segment j, by cell type."""
        rows_by_kind = {kind: rows[segment == j] for kind, (rows, segment) in self.cells[group].items()}
        return {kind: rows for kind, rows in rows_by_kind.items() if rows.size}


def attached_parts(mesh: Mesh, others: Sequence[Member], path: Path, k: int, group: str) -> Attachments:
    """Assign everything to one of the k segments of the line of `group`; connected parts of other members are assigned
    as a whole.

    A part consists of cells that share points off the line. Raises ValueError when a part touches several segments, or
    none.
    """
    on = segments_of(path, k)
    nodes = np.where(on.any(axis=1), on.argmax(axis=1), -1)
    cells: dict[str, dict[str, tuple[IntArray, IntArray]]] = {other.group: {} for other in others}
    member_cells = [(o.group, kind, rows) for o in others for kind, rows in mesh.cell_groups[o.group].items()]
    if not member_cells:
        return Attachments(nodes, cells)
    corner = [mesh.cells[kind][rows] for _, kind, rows in member_cells]
    owner = np.concatenate([np.full(len(c), i) for i, c in enumerate(corner)])
    cell = np.concatenate([np.repeat(np.flatnonzero(owner == i), c.shape[1]) for i, c in enumerate(corner)])
    node = np.concatenate([c.ravel() for c in corner])
    part = _parts(node, cell, np.asarray(~on.any(axis=1)), len(owner))
    allowed = np.ones((part.max() + 1, k), bool)
    touched = np.zeros(part.max() + 1, bool)
    line = np.asarray(on[node].any(axis=1))
    np.logical_and.at(allowed, part[len(on) + cell[line]], on[node[line]])
    touched[part[len(on) + cell[line]]] = True
    part_of_cell = part[len(on) :]
    for i, (name, _, _) in enumerate(member_cells):
        _check(allowed[part_of_cell[owner == i]], touched[part_of_cell[owner == i]], name, group, k)
    segment = allowed.argmax(axis=1)
    off = ~on[node].any(axis=1)
    nodes[node[off]] = segment[part_of_cell[cell[off]]]
    for i, (name, kind, rows) in enumerate(member_cells):
        cells[name][kind] = (rows, segment[part_of_cell[owner == i]])
    return Attachments(nodes, cells)


def segments_of(path: Path, k: int) -> BoolArray:
    """Mask (n_points, k) of the segments that each point lies on; a cut lies on two."""
    position = path.s / path.length * k
    on = np.zeros((len(path.points), k), bool)
    slack = 2 * AT_NODE * k
    for j in range(k):
        on[path.nodes, j] = (position >= j - slack) & (position <= j + 1 + slack)
    return on


def _parts(node: IntArray, cell: IntArray, off: BoolArray, n_cells: int) -> IntArray:
    """Part numbers of all points and then of all cells: cells that share points off the line are one part."""
    kept = off[node]
    size = len(off) + n_cells
    graph = sparse.coo_array((np.ones(kept.sum()), (node[kept], len(off) + cell[kept])), shape=(size, size))
    return csgraph.connected_components(graph, directed=False)[1].astype(np.int64)


def _check(allowed: BoolArray, touched: BoolArray, name: str, group: str, k: int) -> None:
    """Raise ValueError when cells of a member cannot go with one segment."""
    if not touched.all():
        raise ValueError(
            f"the member on group {name!r} has parts that do not touch the line {group!r}, which is cut into {k} "
            "segments; every part must be attached to a segment; make them a separate body"
        )
    if not allowed.any(axis=1).all():
        raise ValueError(
            f"the member on group {name!r} holds several of the {k} segments of {group!r} together, so the line cannot "
            "be cut there; take fewer segments, or make that member a body of its own joined by a joint"
        )
