"""Joining meshes, fusing coincident points, dropping unused ones."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray

if TYPE_CHECKING:
    from femflex.mesh.mesh import CellGroup, Mesh


def doubled_cells(nodes: IntArray) -> IntArray:
    """Numbers (m,) of the cells of one type, nodes (k, n), that have the same nodes as an earlier one."""
    _, first, inverse = np.unique(np.sort(nodes, axis=1), axis=0, return_index=True, return_inverse=True)
    return np.flatnonzero(first[np.ravel(inverse)] != np.arange(len(nodes))).astype(np.int64)


def merged(first: Mesh, second: Mesh) -> Mesh:
    """Both meshes side by side: points and cells of the second after those of the first, equal groups united."""
    shift = len(first.points)
    cells = dict(first.cells)
    for name, rows in second.cells.items():
        cells[name] = np.concatenate([cells[name], rows + shift]) if name in cells else rows + shift
    cell_groups: dict[str, CellGroup] = {g: dict(by_type) for g, by_type in first.cell_groups.items()}
    for group, by_type in second.cell_groups.items():
        rows_by_type = cell_groups.setdefault(group, {})
        for name, rows in by_type.items():
            shifted = rows + len(first.cells.get(name, ()))
            rows_by_type[name] = np.concatenate([rows_by_type[name], shifted]) if name in rows_by_type else shifted
    point_groups = dict(first.point_groups)
    for group, rows in second.point_groups.items():
        point_groups[group] = np.concatenate([point_groups.get(group, rows[:0]), rows + shift])
    points = np.concatenate([first.points, second.points])
    return replace(first, points=points, cells=cells, cell_groups=cell_groups, point_groups=point_groups)


def fused(mesh: Mesh, tolerance: float) -> Mesh:
    """The mesh with points closer than tolerance [m] merged; the first of each cluster is kept."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs, n = coincident(mesh.points, tolerance), len(mesh.points)
    if not len(pairs):
        return mesh
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, cluster = connected_components(links, directed=False)
    _, first = np.unique(cluster, return_index=True)
    return _renumbered(mesh, first[cluster])


def coincident(points: Array, tolerance: float) -> IntArray:
    """Pairs (k, 2) of points closer than tolerance [m], lower index first."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray") if len(points) else np.empty((0, 2))
    return np.asarray(pairs, np.int64)


def unused(mesh: Mesh) -> IntArray:
    """Numbers (k,) of the points that belong to no cell."""
    is_unused = np.ones(len(mesh.points), bool)
    for rows in mesh.cells.values():
        is_unused[rows] = False
    return np.flatnonzero(is_unused)


def compacted(mesh: Mesh) -> Mesh:
    """The mesh without points that belong to no cell and no point group."""
    number = np.arange(len(mesh.points))
    dropped = np.setdiff1d(unused(mesh), np.concatenate([number[:0], *mesh.point_groups.values()]))
    number[dropped] = -1
    return _renumbered(mesh, number) if len(dropped) else mesh


def _renumbered(mesh: Mesh, representative: IntArray) -> Mesh:
    """The mesh on the points that represent themselves; -1 marks a point that is dropped."""
    keep = representative == np.arange(len(representative))
    new_number = np.where(representative >= 0, (np.cumsum(keep) - 1)[representative], -1)
    cells = {name: new_number[rows] for name, rows in mesh.cells.items()}
    point_groups = {group: new_number[rows] for group, rows in mesh.point_groups.items()}
    return replace(mesh, points=mesh.points[keep], cells=cells, point_groups=point_groups)
