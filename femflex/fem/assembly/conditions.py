"""Support conditions of node groups, and the nodes, sides and element interiors that each acts on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.support import Supports, as_support
from femflex.mesh.cells import CELL_TYPES, EDGES

if TYPE_CHECKING:
    from femflex.mesh import Mesh

SAME = 1e-6  # squared sine of the angle below which two directions of supports at a node are one
ROUNDING = 1e-9  # entry of a row, and singular value of rows, below which they are zero


@dataclass(frozen=True, eq=False)
class Condition:
    """One support: its nodes (k,), its edges (n,) as ascending keys (None for a group of points), and the directions in
    which displacement and rotation are zero, as projectors (3, 3)."""

    nodes: IntArray
    edges: IntArray | None
    moves: Array
    turns: Array
    n_points: int

    def contains(self, nodes: IntArray) -> BoolArray:
        """Return which of the sides or interiors with corners `nodes` (n, m) lie on the group, as a mask (n,).

        All their nodes must lie on it. If the group consists of cells, the edges between these nodes must lie on it
        too, because two nodes of a boundary with a corner may be joined by a side that is inside.
        """
        on = np.zeros(self.n_points, bool)
        on[self.nodes] = True
        inside = np.all(on[nodes], axis=1)
        if self.edges is not None and nodes.shape[1] > 1:
            next_nodes = np.roll(nodes, -1, axis=1) if nodes.shape[1] > 2 else nodes[:, ::-1]
            inside = inside & np.all(np.isin(edge_keys(nodes, next_nodes, self.n_points), self.edges), axis=1)
        return np.asarray(inside)


def conditions(mesh: Mesh, supports: Supports) -> tuple[Condition, ...]:
    """The conditions of supports of the mesh's groups; ValueError on unknown groups or components."""
    support_conditions = []
    for group, value in supports.items():
        moves, turns = as_support(value).projectors()
        support_conditions.append(
            Condition(mesh.group_points(group), _edges(mesh, group), moves, turns, len(mesh.points))
        )
    return tuple(support_conditions)


def directions_of(sums: Array) -> Array:
    """Projectors (n, 3, 3) [1] on the ranges of sums of projectors (n, 3, 3)."""
    value, vectors = np.linalg.eigh(sums)
    return np.asarray(np.einsum("nik,nk,njk->nij", vectors, np.where(value > SAME, 1.0, 0.0), vectors))


def edge_keys(a: IntArray, b: IntArray, n_points: int) -> IntArray:
    """Keys (k,), numbers lower * n_points + upper of pairs of nodes (k, 2)."""
    return np.minimum(a, b) * n_points + np.maximum(a, b)


def _edges(mesh: Mesh, group: str) -> IntArray | None:
    """Keys of the edges of a group's cells, halves of second-order ones too; None for a group of points."""
    if group in mesh.point_groups or not mesh.cell_groups.get(group):
        return None
    keys = []
    for name, cells in mesh.group_cells(group).items():
        cell = CELL_TYPES[name]
        if cell.dimension == 0:
            return None
        for k, (i, j) in enumerate(EDGES[cell.shape]):
            ends = [(i, j)] if cell.order == 1 else [(i, j), (i, cell.n_corners + k), (j, cell.n_corners + k)]
            keys += [edge_keys(cells[:, a], cells[:, b], len(mesh.points)) for a, b in ends]
    return np.unique(np.concatenate(keys))


def zero_columns(rows: sparse.csr_array) -> IntArray | None:
    """Return the columns (k,), ascending, that rows @ x = 0 sets to zero; None when it leaves a combination of them
    free."""
    entries = rows.tocoo()
    nonzero = np.abs(entries.data) > ROUNDING
    row, column, value = entries.coords[0][nonzero], entries.coords[1][nonzero], entries.data[nonzero]
    columns, local = np.unique(column, return_inverse=True)
    n = len(columns)
    graph = sparse.coo_array((np.ones(len(row)), (row, local)), shape=(rows.shape[0], n))
    single = np.zeros(n, bool)
    single[local[np.diff(graph.tocsr().indptr)[row] == 1]] = True
    if not single.all():
        coupled = (graph.T @ graph).tocsr()
        _, part = csgraph.connected_components(coupled, directed=False)
        for k in np.unique(part[~single]):
            members = np.flatnonzero(part == k)
            in_part = np.isin(local, members)
            used, block_row = np.unique(row[in_part], return_inverse=True)
            block = np.zeros((len(used), len(members)))
            block[block_row, np.searchsorted(members, local[in_part])] = value[in_part]
            if np.linalg.matrix_rank(block, tol=ROUNDING) < len(members):
                return None
    return columns.astype(np.int64)
