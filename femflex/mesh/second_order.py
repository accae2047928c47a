"""Cells of first order raised to second order: a node in the middle of every edge, shared by all cells on it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, BoolArray, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh

Keys = NDArray[np.uint64]
Rows = Mapping[str, IntArray]  # cell type -> rows of the mesh's cells

SECOND_ORDER = {
    "line": "line3",
    "triangle": "triangle6",
    "quad": "quad8",
    "tetra": "tetra10",
    "pyramid": "pyramid13",
    "wedge": "wedge15",
    "hexahedron": "hexahedron20",
    "quad8": "quad9",
}
MAX_PARENTS = 8


def raise_order(mesh: Mesh, rows: Rows, keep: Rows | None = None) -> Mesh:
    """The mesh with these cells replaced by the next type of `SECOND_ORDER`.

    The positions of new nodes follow from the cell's shape functions: middles of edges, and of eight-node quads. Cells
    of lower dimension whose edges are all edges of raised solids or surfaces are raised with them, except those in
    `keep`. A new node joins a point group if all nodes of its edge or quad belong to it. Existing middle nodes of
    second-order neighbours are shared.
    """
    raised_rows = {kind: np.asarray(cell_rows, np.int64) for kind, cell_rows in rows.items() if len(cell_rows)}
    if not raised_rows:
        return mesh
    new_nodes = _NewNodes(mesh, mesh.cells)
    for kind, cell_rows in raised_rows.items():
        new_nodes.add_nodes_of(kind, mesh.cells[kind][cell_rows])
    for kind, cell_rows in _lower_cells_on_edges(mesh, new_nodes, raised_rows, keep or {}).items():
        raised_rows[kind] = cell_rows
    cells: dict[str, list[IntArray]] = {}
    new_row: dict[str, IntArray] = {}  # old type -> row of each of its cells, in the new type or in the same
    for kind, nodes in mesh.cells.items():
        unchanged = np.ones(len(nodes), bool)
        unchanged[raised_rows.get(kind, np.zeros(0, np.int64))] = False
        new_row[kind] = np.cumsum(unchanged) - 1
        if unchanged.any():
            cells[kind] = [nodes[unchanged]]
    for kind, cell_rows in raised_rows.items():
        target = SECOND_ORDER[kind]
        start = sum(len(part) for part in cells.get(target, []))
        new_row[kind][cell_rows] = start + np.arange(len(cell_rows))
        cells.setdefault(target, []).append(new_nodes.second_order_nodes(kind, mesh.cells[kind][cell_rows]))
    points = np.concatenate([mesh.points, *new_nodes.points])
    groups: dict[str, dict[str, IntArray]] = {}
    for group, by_type in mesh.cell_groups.items():
        rows_by_type: dict[str, list[IntArray]] = {}
        for kind, members in by_type.items():
            is_raised = np.isin(members, raised_rows.get(kind, np.zeros(0, np.int64)))
            rows_by_type.setdefault(kind, []).append(new_row[kind][members[~is_raised]])
            if is_raised.any():
                rows_by_type.setdefault(SECOND_ORDER[kind], []).append(new_row[kind][members[is_raised]])
        groups[group] = {kind: np.concatenate(parts) for kind, parts in rows_by_type.items()}
    point_groups = {group: new_nodes.extended_group(members) for group, members in mesh.point_groups.items()}
    return Mesh(points, {kind: np.concatenate(parts) for kind, parts in cells.items()}, groups, point_groups)


def rows_between(mesh: Mesh, around: Mapping[str, IntArray], keep: Rows) -> dict[str, IntArray]:
    """Rows of the lines and surfaces, except those in `keep`, whose additional nodes in the next type of `SECOND_ORDER`
    are all middle nodes of the cells `around`, cell type -> nodes (n, k)."""
    kinds = [kind for kind in mesh.cells if kind in SECOND_ORDER and CELL_TYPES[kind].dimension < 3]
    if not around or not kinds:
        return {}
    middles, rows = _NewNodes(mesh, around), {}
    for kind in kinds:
        cell, nodes = CELL_TYPES[kind], mesh.cells[kind]
        between = np.ones(len(nodes), bool)
        between[keep.get(kind, np.zeros(0, np.int64))] = False
        for parents in CELL_TYPES[SECOND_ORDER[kind]].parents[len(cell.nodes) - cell.n_corners :]:
            between &= middles.exist_between(nodes, parents, first=0)
        if between.any():
            rows[kind] = np.flatnonzero(between)
    return rows


class _NewNodes:
    """Nodes between corners, identified by a key: the sum, modulo 2^64, of random marks of the corners.

    Two different positions share a key with probability 2^-64. cells: those whose middle nodes exist before.
    """

    def __init__(self, mesh: Mesh, cells: Mapping[str, IntArray]) -> None:
        self._mesh = mesh
        self._marks = np.random.default_rng(0).integers(1, 2**63, len(mesh.points), dtype=np.uint64)
        self._n = self._first = len(mesh.points)
        self.points: list[Array] = []
        self._parents: list[IntArray] = []
        keys, numbers = [np.zeros(0, np.uint64)], [np.zeros(0, np.int64)]
        for kind, nodes in cells.items():
            cell = CELL_TYPES[kind]
            for column, parents in enumerate(cell.parents, cell.n_corners):
                keys.append(self._key(nodes, parents))
                numbers.append(nodes[:, column])
        self._keys, first = np.unique(np.concatenate(keys), return_index=True)
        self._numbers = np.concatenate(numbers)[first]

    def add_nodes_of(self, kind: str, nodes: IntArray) -> None:
        """Add the new nodes of cells (n, k) of this type, with numbers and positions."""
        cell, target = CELL_TYPES[kind], CELL_TYPES[SECOND_ORDER[kind]]
        weights = cell.interpolation(target.nodes)
        for column in range(len(cell.nodes), len(target.nodes)):
            parents = target.parents[column - target.n_corners]
            keys, first = np.unique(self._key(nodes, parents), return_index=True)
            is_new = ~np.isin(keys, self._keys)
            keys, owner_nodes = keys[is_new], nodes[first[is_new]]
            self._keys = np.concatenate([self._keys, keys])
            self._numbers = np.concatenate([self._numbers, self._n + np.arange(len(keys))])
            order = np.argsort(self._keys)
            self._keys, self._numbers = self._keys[order], self._numbers[order]
            self._n += len(keys)
            corners = owner_nodes[:, parents]
            self._parents.append(np.pad(corners, [(0, 0), (0, MAX_PARENTS - len(parents))], mode="edge"))
            self.points.append(np.einsum("k,nki->ni", weights[column], self._mesh.points[owner_nodes]))

    def second_order_nodes(self, kind: str, nodes: IntArray) -> IntArray:
        """Nodes of cells (n, k) of this type, with the new nodes appended."""
        cell, target = CELL_TYPES[kind], CELL_TYPES[SECOND_ORDER[kind]]
        new_columns = [
            self._number(self._key(nodes, target.parents[column - target.n_corners]))
            for column in range(len(cell.nodes), len(target.nodes))
        ]
        return np.column_stack([nodes, *new_columns])

    def exist_between(self, nodes: IntArray, parents: IntArray, first: int) -> BoolArray:
        """Mask (n,) of the cells (n, k) with a node between these corners whose number is `first` or higher."""
        return self._number(self._key(nodes, parents)) >= first

    def extended_group(self, members: IntArray) -> IntArray:
        """A point group, members (k,), with the new nodes whose corners are all in it."""
        inside = np.zeros(self._first, bool)
        inside[members] = True
        parents = np.concatenate(self._parents)
        return np.concatenate([members, self._first + np.flatnonzero(inside[parents].all(axis=1))])

    def _key(self, nodes: IntArray, parents: IntArray) -> Keys:
        return np.asarray(self._marks[nodes[:, parents]].sum(axis=1, dtype=np.uint64))

    def _number(self, keys: Keys) -> IntArray:
        """Numbers of the nodes with these keys; -1 if there is no such node."""
        if not len(self._keys):
            return np.full(len(keys), -1, np.int64)
        slot = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return np.where(self._keys[slot] == keys, self._numbers[slot], -1)


def _lower_cells_on_edges(mesh: Mesh, new_nodes: _NewNodes, raised_rows: Rows, keep: Rows) -> dict[str, IntArray]:
    """Lines and faces of first order on the edges of raised cells of higher dimension."""
    max_dimension = max(CELL_TYPES[kind].dimension for kind in raised_rows)
    rows = {}
    for kind, nodes in mesh.cells.items():
        cell = CELL_TYPES[kind]
        if cell.order > 1 or not 0 < cell.dimension < max_dimension or kind in raised_rows:
            continue
        target = CELL_TYPES[SECOND_ORDER[kind]]
        on_edges = np.ones(len(nodes), bool)
        on_edges[keep.get(kind, np.zeros(0, np.int64))] = False
        for parents in target.parents:
            on_edges &= new_nodes.exist_between(nodes, parents, first=len(mesh.points))
        if on_edges.any():
            rows[kind] = np.flatnonzero(on_edges)
    return rows
