"""Directors of shells at nodes: unit normals, which neighbours share where the surface is smooth, but not at folds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES


@dataclass(frozen=True, eq=False)
class Directors:
    """Directors of the nodes of elements.

    V       by cell type (e, k, 3) unit vectors
    number  by cell type (e, k): number of the member's director; a node at a fold has several
    node    (n,)   the node of each director
    vector  (n, 3)
    """

    V: dict[str, Array]
    number: dict[str, IntArray]
    node: IntArray
    vector: Array


def normals_at_nodes(name: str, x: Array) -> Array:
    """Normals (e, k, 3) [m^2] of elements with nodes x (e, k, 3), of the length of an area."""
    cell = CELL_TYPES[name]
    along = np.einsum("qkd,eki->eqid", cell.gradients(cell.nodes), x - x[:, :1])
    return np.cross(along[..., 0], along[..., 1])


def directors(
    points: Array,
    cells: dict[str, IntArray],
    fold_angle: float,
    surface_normals: Callable[[Array], Array] | None = None,
) -> Directors:
    """Directors of cells (e, k) by type; elements at a node share one where a chain of sides with angles between
    their normals below fold_angle [rad] joins them there. surface_normals: returns unit normals (n, 3) of the surface
    at positions (n, 3) [m], which are used instead of those of the elements."""
    normals = {name: normals_at_nodes(name, points[nodes]) for name, nodes in cells.items()}
    node = np.concatenate([nodes.ravel() for nodes in cells.values()])
    normal = np.concatenate([element_directors.reshape(-1, 3) for element_directors in normals.values()])
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    if surface_normals is not None:
        exact = surface_normals(points[node])
        unit = exact * np.where(np.sum(exact * unit, axis=1, keepdims=True) < 0, -1.0, 1.0)
    a, b = _neighbours(node)
    cosine = np.sum(unit[a] * unit[b], axis=1)
    smooth = np.abs(cosine) > np.cos(fold_angle)
    graph = sparse.coo_array((np.ones(smooth.sum()), (a[smooth], b[smooth])), shape=(len(node), len(node)))
    count, number = csgraph.connected_components(graph, directed=False)
    first = np.full(count, -1, np.int64)
    first[number[::-1]] = np.arange(len(node))[::-1]
    sense = np.sign(np.sum(unit * unit[first[number]], axis=1))
    sense = np.where(sense == 0, 1.0, sense)  # the nodes of elements may be numbered in either sense
    total = np.zeros((count, 3))
    np.add.at(total, number, sense[:, None] * unit)
    vector = total / np.linalg.norm(total, axis=1, keepdims=True)
    V, numbers, start = {}, {}, 0
    for name, nodes in cells.items():
        entries = slice(start, start + nodes.size)
        start += nodes.size
        element_directors = vector[number[entries]] * sense[entries, None]
        V[name], numbers[name] = (
            element_directors.reshape(*nodes.shape, 3),
            number[entries].reshape(nodes.shape).astype(np.int64),
        )
    return Directors(V, numbers, node[first], vector)


def _neighbours(node: IntArray) -> tuple[IntArray, IntArray]:
    """All pairs of entries of node (m,) that are at one node."""
    order = np.argsort(node, kind="stable")
    count = np.bincount(node)
    count = count[count > 0]
    start = np.cumsum(count) - count
    first, second = [], []
    for size in np.unique(count):
        i, j = np.triu_indices(size, 1)
        rows = start[count == size][:, None]
        first.append((rows + i).ravel())
        second.append((rows + j).ravel())
    return order[np.concatenate(first)], order[np.concatenate(second)]
