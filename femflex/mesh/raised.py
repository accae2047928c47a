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
MOST_PARENTS = 8


def raised(mesh: Mesh, rows: Rows, keep: Rows | None = None) -> Mesh:
    """The mesh with these cells replaced by the next type of `SECOND_ORDER`.

    New nodes lie where the cell's own shape functions put them: in the middle of edges, in that of eight-node quads.
    Cells of lower dimension whose edges are all edges of raised solids or surfaces are raised with them, those of
    `keep` apart. A new node joins a point group when all nodes of the edge or quad it lies on belong to it. Middle
    nodes that neighbours of second order have already are shared.
    """
    chosen = {kind: np.asarray(own, np.int64) for kind, own in rows.items() if len(own)}
    if not chosen:
        return mesh
    added = _NewNodes(mesh)
    for kind, own in chosen.items():
        added.wanted(kind, mesh.cells[kind][own])
    for kind, own in _on_edges(mesh, added, chosen, keep or {}).items():
        chosen[kind] = own
    cells: dict[str, list[IntArray]] = {}
    place: dict[str, IntArray] = {}  # old type -> where its cells went, as rows of the new type or of the same
    for kind, nodes in mesh.cells.items():
        stay = np.ones(len(nodes), bool)
        stay[chosen.get(kind, np.zeros(0, np.int64))] = False
        place[kind] = np.cumsum(stay) - 1
        if stay.any():
            cells[kind] = [nodes[stay]]
    for kind, own in chosen.items():
        target = SECOND_ORDER[kind]
        start = sum(len(part) for part in cells.get(target, []))
        place[kind][own] = start + np.arange(len(own))
        cells.setdefault(target, []).append(added.completed(kind, mesh.cells[kind][own]))
    points = np.concatenate([mesh.points, *added.points])
    groups: dict[str, dict[str, IntArray]] = {}
    for group, by_type in mesh.cell_groups.items():
        found: dict[str, list[IntArray]] = {}
        for kind, members in by_type.items():
            up = np.isin(members, chosen.get(kind, np.zeros(0, np.int64)))
            found.setdefault(kind, []).append(place[kind][members[~up]])
            if up.any():
                found.setdefault(SECOND_ORDER[kind], []).append(place[kind][members[up]])
        groups[group] = {kind: np.concatenate(parts) for kind, parts in found.items()}
    point_groups = {group: added.grown(members) for group, members in mesh.point_groups.items()}
    return Mesh(points, {kind: np.concatenate(parts) for kind, parts in cells.items()}, groups, point_groups)


class _NewNodes:
    """Nodes between corners, found by a key: the sum, modulo 2^64, of random marks of the corners they lie between.

    Two different places share a key with probability 2^-64.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._mesh = mesh
        self._marks = np.random.default_rng(0).integers(1, 2**63, len(mesh.points), dtype=np.uint64)
        self._n = self._first = len(mesh.points)
        self.points: list[Array] = []
        self._parents: list[IntArray] = []
        keys, numbers = [np.zeros(0, np.uint64)], [np.zeros(0, np.int64)]
        for kind, nodes in mesh.cells.items():
            cell = CELL_TYPES[kind]
            for column, parents in enumerate(cell.parents, cell.n_corners):
                keys.append(self._key(nodes, parents))
                numbers.append(nodes[:, column])
        self._keys, first = np.unique(np.concatenate(keys), return_index=True)
        self._numbers = np.concatenate(numbers)[first]

    def wanted(self, kind: str, nodes: IntArray) -> None:
        """Number and place the nodes that cells (n, k) of the type get when they are raised."""
        cell, target = CELL_TYPES[kind], CELL_TYPES[SECOND_ORDER[kind]]
        weights = cell.interpolation(target.nodes)
        for column in range(len(cell.nodes), len(target.nodes)):
            parents = target.parents[column - target.n_corners]
            keys, first = np.unique(self._key(nodes, parents), return_index=True)
            fresh = ~np.isin(keys, self._keys)
            keys, own = keys[fresh], nodes[first[fresh]]
            self._keys = np.concatenate([self._keys, keys])
            self._numbers = np.concatenate([self._numbers, self._n + np.arange(len(keys))])
            order = np.argsort(self._keys)
            self._keys, self._numbers = self._keys[order], self._numbers[order]
            self._n += len(keys)
            corners = own[:, parents]
            self._parents.append(np.pad(corners, [(0, 0), (0, MOST_PARENTS - len(parents))], mode="edge"))
            self.points.append(np.einsum("k,nki->ni", weights[column], self._mesh.points[own]))

    def completed(self, kind: str, nodes: IntArray) -> IntArray:
        """Nodes of cells (n, k) of the type with those they got."""
        cell, target = CELL_TYPES[kind], CELL_TYPES[SECOND_ORDER[kind]]
        more = [
            self._number(self._key(nodes, target.parents[column - target.n_corners]))
            for column in range(len(cell.nodes), len(target.nodes))
        ]
        return np.column_stack([nodes, *more])

    def known(self, nodes: IntArray, parents: IntArray) -> BoolArray:
        """Which cells (n, k) have a new node between these corners."""
        return self._number(self._key(nodes, parents)) >= self._first

    def grown(self, members: IntArray) -> IntArray:
        """A point group with the new nodes whose corners are all in it."""
        inside = np.zeros(self._first, bool)
        inside[members] = True
        parents = np.concatenate(self._parents)
        return np.concatenate([members, self._first + np.flatnonzero(inside[parents].all(axis=1))])

    def _key(self, nodes: IntArray, parents: IntArray) -> Keys:
        return np.asarray(self._marks[nodes[:, parents]].sum(axis=1, dtype=np.uint64))

    def _number(self, keys: Keys) -> IntArray:
        """Numbers of the nodes with these keys; -1 where there is none."""
        if not len(self._keys):
            return np.full(len(keys), -1, np.int64)
        slot = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return np.where(self._keys[slot] == keys, self._numbers[slot], -1)


def _on_edges(mesh: Mesh, added: _NewNodes, chosen: Rows, keep: Rows) -> dict[str, IntArray]:
    """Lines and faces of first order on the edges of raised cells of higher dimension."""
    most = max(CELL_TYPES[kind].dimension for kind in chosen)
    found = {}
    for kind, nodes in mesh.cells.items():
        cell = CELL_TYPES[kind]
        if cell.order > 1 or not 0 < cell.dimension < most or kind in chosen:
            continue
        target = CELL_TYPES[SECOND_ORDER[kind]]
        on = np.ones(len(nodes), bool)
        on[keep.get(kind, np.zeros(0, np.int64))] = False
        for parents in target.parents:
            on &= added.known(nodes, parents)
        if on.any():
            found[kind] = np.flatnonzero(on)
    return found
