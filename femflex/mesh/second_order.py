"""Cells of first order raised to second order: a node in the middle of every edge, shared by all cells on it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh
from femflex.mesh.refine import keys_of, marks_of, points_at

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


def raise_order(mesh: Mesh, rows: Rows, keep: Rows | None = None) -> Mesh:
    """The mesh with these cells replaced by the next type of `SECOND_ORDER`.

    The positions of new nodes follow from the cell's shape functions: middles of edges, and of eight-node quads. Cells
    of lower dimension whose edges are all edges of raised solids or surfaces are raised with them, except those in
    `keep`. A new node joins a point group if all corners of its edge or quad belong to it. Existing middle nodes of
    second-order neighbours are shared.
    """
    raised = {kind: np.asarray(numbers, np.int64) for kind, numbers in rows.items() if len(numbers)}
    if not raised:
        return mesh
    dimension = max(CELL_TYPES[kind].dimension for kind in raised)
    lower = {kind: nodes for kind, nodes in mesh.cells.items() if kind not in raised and CELL_TYPES[kind].order == 1}
    lower = {kind: nodes for kind, nodes in lower.items() if 0 < CELL_TYPES[kind].dimension < dimension}
    around = {SECOND_ORDER[kind]: mesh.cells[kind][numbers] for kind, numbers in raised.items()}
    raised |= rows_between(mesh, around, keep or {}, lower)
    parts = [(kind, mesh.cells[kind][numbers], _added_nodes(kind)) for kind, numbers in raised.items()]
    points, new_nodes = points_at(mesh, marks_of(mesh), parts, strict=False)
    cells: dict[str, list[IntArray]] = {}
    new_row: dict[str, IntArray] = {}  # old type -> row of each of its cells, in the new type or in the same
    for kind, nodes in mesh.cells.items():
        unchanged = np.ones(len(nodes), bool)
        unchanged[raised.get(kind, np.zeros(0, np.int64))] = False
        new_row[kind] = np.cumsum(unchanged) - 1
        if unchanged.any():
            cells[kind] = [nodes[unchanged]]
    joins = {group: [members] for group, members in mesh.point_groups.items()}
    for (kind, nodes, _), more in zip(parts, new_nodes, strict=True):
        target = CELL_TYPES[SECOND_ORDER[kind]]
        new_row[kind][raised[kind]] = sum(len(part) for part in cells.get(target.name, [])) + np.arange(len(nodes))
        cells.setdefault(target.name, []).append(np.column_stack([nodes, more]))
        for group, members in mesh.point_groups.items():
            inside = np.isin(nodes, members)
            for parents, numbers in zip(target.parents[nodes.shape[1] - target.n_corners :], more.T, strict=True):
                joins[group].append(numbers[inside[:, parents].all(axis=1) & (numbers >= len(mesh.points))])
    groups: dict[str, dict[str, IntArray]] = {}
    for group, by_type in mesh.cell_groups.items():
        rows_by_type: dict[str, list[IntArray]] = {}
        for kind, members in by_type.items():
            is_raised = np.isin(members, raised.get(kind, np.zeros(0, np.int64)))
            rows_by_type.setdefault(kind, []).append(new_row[kind][members[~is_raised]])
            if is_raised.any():
                rows_by_type.setdefault(SECOND_ORDER[kind], []).append(new_row[kind][members[is_raised]])
        groups[group] = {kind: np.concatenate(numbers) for kind, numbers in rows_by_type.items()}
    joined = {kind: np.concatenate(nodes) for kind, nodes in cells.items()}
    return Mesh(points, joined, groups, {group: np.concatenate(members) for group, members in joins.items()})


def rows_between(
    mesh: Mesh, around: Mapping[str, IntArray], keep: Rows, among: Mapping[str, IntArray] | None = None
) -> dict[str, IntArray]:
    """Rows of the lines and surfaces, except those in `keep`, whose additional nodes in the next type of `SECOND_ORDER`
    are all middle nodes of the cells `around`, cell type -> nodes (n, k), of which the corners suffice.

    among: cells that are examined, by default all
    """
    marks, rows = marks_of(mesh), {}
    middles = [np.zeros(0, np.uint64)]
    for kind, nodes in around.items():
        middles.append(keys_of((kind, nodes, CELL_TYPES[kind].nodes[CELL_TYPES[kind].n_corners :]), marks).ravel())
    for kind, nodes in (mesh.cells if among is None else among).items():
        if kind not in SECOND_ORDER or CELL_TYPES[kind].dimension == 3:
            continue
        is_middle = np.isin(keys_of((kind, nodes, _added_nodes(kind)), marks), np.concatenate(middles))
        between = np.asarray(is_middle.all(axis=1))
        between[keep.get(kind, np.zeros(0, np.int64))] = False
        if between.any():
            rows[kind] = np.flatnonzero(between)
    return rows


def _added_nodes(kind: str) -> Array:
    """Positions (m, d) on the unit cell of the nodes that the next type has in addition."""
    return CELL_TYPES[SECOND_ORDER[kind]].nodes[len(CELL_TYPES[kind].nodes) :]
