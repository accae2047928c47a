"""Uniform subdivision: every cell in two along each edge, groups kept.

A pyramid divides into six pyramids, one at each corner and one upside down in the middle, and four tetrahedra between
them.

New points lie where the cell's own shape functions put the middles (and quarters) of its unit cell, so curved cells
stay curved. Neighbours find their shared points by a key: the weights of the point on the corners of its cell, which
only involve the corners of the edge or face it lies on.

Groups of cells go to the children exactly. A new point joins a group of points if all nodes of the smallest edge, face
or cell it lies in belong to the group: middles between two points of a group join it wherever a cell has that edge, and
groups of single points stay as they are. Where two boundaries of one group are a single cell apart, the edges that
cross from one to the other join as well; name such boundaries as groups of cells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray
from femflex.memory import require_memory
from femflex.mesh.cells import CELL_TYPES, CellType

if TYPE_CHECKING:
    from femflex.mesh.mesh import Mesh

Keys = NDArray[np.uint64]

STEPS = 64  # corner weights of all new points are whole multiples of 1/64; within pyramids they are rounded to it
DUST = 1e-9  # corner weights below are rounding

WORKING = 8.0  # bytes taken while refining, over those of the refined mesh (measured)


def check_memory(mesh: Mesh, times: int) -> None:
    """Raise ValueError where the mesh refined so often needs more memory than is free; warn of more than a GB."""
    often, cells, need = min(times, 60), 0.0, 0.0  # 60: beyond any memory, within floats
    for cell, nodes in mesh.cells.items():
        count = len(nodes) * 2.0 ** (often * CELL_TYPES[cell].dimension)
        cells += count
        need += 8 * nodes.shape[1] * count
    need += 24 * len(mesh.points) * 2.0 ** (often * mesh.dimension)
    if times:
        what = f"a mesh of {sum(map(len, mesh.cells.values()))} cells refined {times} times to {cells:.3g}"
        require_memory(WORKING * need, what, "refine it less often.")


def refined(mesh: Mesh, times: int = 1) -> Mesh:
    """The mesh with every cell divided in two along each edge, `times` times."""
    check_memory(mesh, times)
    for _ in range(times):
        mesh = divided(mesh)
    return mesh


def divided(mesh: Mesh) -> Mesh:
    """The mesh with every cell divided in two along each edge."""
    marks = _marks(mesh)
    old_keys, old_points = _known(mesh, marks)
    keys, places = [], []
    ordered = sorted(mesh.cells.items(), key=lambda item: -CELL_TYPES[item[0]].order)  # curved cells place their points
    for cell, nodes in ordered:
        at = _lattice(cell)
        keys.append(_keys(cell, nodes, at, marks))
        places.append(CELL_TYPES[cell].interpolation(at) @ mesh.points[nodes])
    flat = np.concatenate([np.empty(0, np.uint64), *(k.ravel() for k in keys)])
    unique, first, number = np.unique(flat, return_index=True, return_inverse=True)
    slot = np.minimum(np.searchsorted(old_keys, unique), max(len(old_keys) - 1, 0))
    fresh = old_keys[slot] != unique
    point = np.where(fresh, len(mesh.points) + np.cumsum(fresh) - 1, old_points[slot])
    where = np.concatenate([np.empty((0, 3)), *(p.reshape(-1, 3) for p in places)])
    points = np.concatenate([mesh.points, where[first[fresh]]])

    rows = np.split(point[number.ravel()], np.cumsum([k.size for k in keys])[:-1])
    lattices = {cell: part.reshape(k.shape) for (cell, _), part, k in zip(ordered, rows, keys, strict=True)}
    cells: dict[str, list[IntArray]] = {}
    born: dict[str, list[tuple[str, int, int]]] = {}  # by type of the parent: type, first row and number of children
    for cell, nodes in mesh.cells.items():
        born[cell] = []
        for kind, children in _children(cell, mesh.points[nodes], lattices[cell]).items():
            own = cells.setdefault(kind, [])
            born[cell].append((kind, sum(map(len, own)), children.shape[1]))
            own.append(children.reshape(-1, children.shape[2]))
    cell_groups = {group: _of_parents(by_type, born) for group, by_type in mesh.cell_groups.items()}
    point_groups = {g: _grown(mesh, members, lattices, len(points)) for g, members in mesh.point_groups.items()}
    joined = {kind: np.concatenate(parts) for kind, parts in cells.items()}
    return replace(mesh, points=points, cells=joined, cell_groups=cell_groups, point_groups=point_groups)


def refined_values(cell: str, values: Array) -> Array:
    """Values, in any unit, of the children of cells by those of the cells, (e,) or (e, corners), ordered as a refined
    group.

    Values at corners are interpolated. Of cells whose children are of one type and are cut alike.
    """
    kind = CELL_TYPES[cell]
    (children,) = _cuts(kind)
    if values.ndim == 1:
        return np.repeat(values, len(children))
    at = np.stack([CELL_TYPES[kind.corner].interpolation(corners) for corners in children])  # child, corner, parent's
    return np.asarray(np.einsum("nck,ek->enc", at, values).reshape(-1, at.shape[1]))


def _of_parents(by_type: Mapping[str, IntArray], born: dict[str, list[tuple[str, int, int]]]) -> dict[str, IntArray]:
    """Rows of the children of a group of cells, by their type."""
    found: dict[str, list[IntArray]] = {}
    for cell, rows in by_type.items():
        for kind, start, count in born[cell]:
            found.setdefault(kind, []).append((start + rows[:, None] * count + np.arange(count)).ravel())
    return {kind: np.concatenate(parts) for kind, parts in found.items()}


def _marks(mesh: Mesh) -> Keys:
    """Random marks (n_points,) of the points by which new points know each other.

    A middle of a cell that is a corner of another one (ribs of two lines on an edge of a nine-node shell) has the mean
    of the marks of the corners about it, so that both cells find the same points: marks are multiples of eight, and
    shares exact.
    """
    marks = np.random.default_rng(0).integers(1, 2**63, len(mesh.points), dtype=np.uint64) & ~np.uint64(7)
    corner = np.zeros(len(mesh.points), bool)
    for cell, nodes in mesh.cells.items():
        corner[nodes[:, : CELL_TYPES[cell].n_corners]] = True
    for cell, nodes in mesh.cells.items():
        kind = CELL_TYPES[cell]
        for node, parents in enumerate(kind.parents, kind.n_corners):
            own = corner[nodes[:, node]]
            if own.any() and len(parents) in (2, 4, 8):
                shares = marks[nodes[own][:, list(parents)]] // np.uint64(len(parents))
                marks[nodes[own, node]] = shares.sum(axis=1, dtype=np.uint64)
    return marks


def _keys(cell: str, nodes: IntArray, at: Array, marks: Keys) -> Keys:
    """Keys (n, m) of positions at (m, d): the weighted sum, modulo 2^64, of random marks of the corners.

    Two different points share a key with probability 2^-64.
    """
    kind = CELL_TYPES[cell]
    weights = np.rint(CELL_TYPES[kind.corner].interpolation(at) * STEPS).astype(np.uint64)
    corners = marks[nodes[:, : kind.n_corners]]
    total = np.zeros((len(nodes), len(at)), np.uint64)
    for corner in range(kind.n_corners):
        total += corners[:, corner, None] * weights[None, :, corner]
    return total


def _known(mesh: Mesh, marks: Keys) -> tuple[Keys, IntArray]:
    """Sorted keys of the points that cells have already, and these points."""
    keys = [_keys(cell, nodes, CELL_TYPES[cell].nodes, marks).ravel() for cell, nodes in mesh.cells.items()]
    points = [nodes.ravel() for nodes in mesh.cells.values()]
    pairs_key = np.concatenate([np.empty(0, np.uint64), *keys])
    pairs_point = np.concatenate([np.empty(0, np.int64), *points])
    unique, first, which = np.unique(pairs_key, return_index=True, return_inverse=True)
    differ = pairs_point[first][which.ravel()] != pairs_point
    if differ.any():
        a, b = pairs_point[first][which.ravel()][differ][0], pairs_point[differ][0]
        raise ValueError(
            f"points {a} and {b} are both the middle of one edge or face: two curved cells there share their corners "
            "but not their middles. Such cells cannot be subdivided; mesh them finer."
        )
    return unique, pairs_point[first]


@cache
def _lattice(cell: str) -> Array:
    """Positions (m, d) on the unit cell of all nodes of all its possible children."""
    every = np.concatenate([child for option in _child_nodes(cell) for _, child in option])
    return np.asarray(every[np.unique(np.round(every, 12), axis=0, return_index=True)[1]])


@cache
def _child_nodes(cell: str) -> list[list[tuple[str, Array]]]:
    """Type and node positions (k, d) of the children, for each way of cutting (three for tetrahedra)."""
    kind = CELL_TYPES[cell]
    return [[_placed(kind, corners) for corners in option] for option in _cuts(kind)]


def _placed(kind: CellType, corners: Array) -> tuple[str, Array]:
    """Type of the child of a cell with corners (c, d) and its nodes (k, d) on the unit cell of the parent."""
    own = kind
    if kind.shape == "pyramid" and len(corners) == 4:
        own = CELL_TYPES["tetra10" if kind.order == 2 else "tetra"]
    places = CELL_TYPES[own.corner].interpolation(own.nodes) @ corners
    return own.name, _in_cube(places) if kind.shape == "pyramid" else places


def _cuts(kind: CellType) -> list[list[Array]]:
    """Corner positions of the children, for each way of cutting; of pyramids in x, y, z, not in their cube."""
    corners = kind.nodes[: kind.n_corners]
    halves = [(corners + corner) / 2 for corner in corners]
    if kind.shape == "triangle":
        return [[*halves, 0.5 - corners / 2]]
    if kind.shape == "wedge":
        turned = np.column_stack([0.5 - corners[:, :2] / 2, corners[:, 2] / 2])
        return [[*halves, turned, turned + np.array([0, 0, 0.5])]]
    if kind.shape == "tetra":
        return [halves + _octahedron(corners, pair) for pair in _OPPOSITE]
    return [_pyramid_children()] if kind.shape == "pyramid" else [halves]


def _pyramid_children() -> list[Array]:
    """Corners of the six pyramids and four tetrahedra of the pyramid with base [0, 1]^2 at z = 0 and apex (0, 0, 1)."""
    base, apex = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([0, 0, 1.0])
    side, upright, centre = (base + np.roll(base, -1, axis=0)) / 2, (base + apex) / 2, base.mean(axis=0)
    low = [np.array([base[k], side[k], centre, side[k - 1], upright[k]]) for k in range(4)]
    between = [np.array([side[k], upright[(k + 1) % 4], upright[k], centre]) for k in range(4)]
    between = [part if np.linalg.det(part[1:] - part[0]) > 0 else part[[0, 2, 1, 3]] for part in between]
    return [*low, np.array([*upright, apex]), np.array([*upright[[0, 3, 2, 1]], centre]), *between]


def _in_cube(places: Array) -> Array:
    """Places (k, 3) in that pyramid as positions (a, b, w) of its cube."""
    w = 1.0 - places[:, 2]
    flat = places[:, [1, 0]] / np.where(w > 0, w, 1.0)[:, None]
    return np.column_stack([np.where(w[:, None] > 0, flat, 0.5), w])


# The inner octahedron of a tetrahedron by its diagonal (two opposite edges) and the ring of the other four edges.
_OPPOSITE = [
    [(0, 1), (2, 3), (0, 2), (0, 3), (1, 3), (1, 2)],
    [(0, 2), (1, 3), (0, 1), (0, 3), (2, 3), (1, 2)],
    [(0, 3), (1, 2), (0, 1), (0, 2), (2, 3), (1, 3)],
]


def _octahedron(corners: Array, edges: list[tuple[int, int]]) -> list[Array]:
    """Four tetrahedra round a diagonal of the inner octahedron."""
    low, high, *ring = (corners[list(edge)].mean(axis=0) for edge in edges)
    parts = []
    for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
        part = np.array([low, high, a, b])
        parts.append(part if np.linalg.det(part[1:] - part[0]) > 0 else part[[0, 1, 3, 2]])
    return parts


def _children(cell: str, places: Array, lattice: IntArray) -> dict[str, IntArray]:
    """Nodes (n, children, k) of the children by type; tetrahedra are cut along their shortest inner diagonal."""
    at = _lattice(cell)
    tables: list[dict[str, IntArray]] = []
    for option in _child_nodes(cell):
        table: dict[str, list[list[int]]] = {}
        for kind, child in option:
            table.setdefault(kind, []).append([int(np.argmin(np.abs(at - node).sum(axis=1))) for node in child])
        tables.append({kind: lattice[:, np.array(rows)] for kind, rows in table.items()})
    if len(tables) == 1:
        return tables[0]
    diagonals = [places[:, list(e[0])].mean(axis=1) - places[:, list(e[1])].mean(axis=1) for e in _OPPOSITE]
    shortest = np.argmin([np.linalg.norm(d, axis=1) for d in diagonals], axis=0)
    return {cell: np.asarray(np.stack([table[cell] for table in tables])[shortest, np.arange(len(lattice))])}


def _grown(mesh: Mesh, members: IntArray, lattices: dict[str, IntArray], n_points: int) -> IntArray:
    """A point group with the new points whose whole edge, face or cell is in it."""
    inside = np.zeros(n_points, bool)
    inside[members] = True
    joins = np.ones(n_points, bool)
    joins[: len(mesh.points)] = inside[: len(mesh.points)]
    for cell, nodes in mesh.cells.items():
        kind = CELL_TYPES[cell]
        weights = CELL_TYPES[kind.corner].interpolation
        held = weights(_lattice(cell)) > DUST  # corners of the smallest part that holds the position
        needed = ~((weights(kind.nodes) > DUST)[None] & ~held[:, None]).any(axis=2)  # nodes of that part
        missing = (~inside[nodes]).astype(np.int64) @ needed.T.astype(np.int64) > 0
        joins[lattices[cell][missing]] = False
    joins[: len(mesh.points)] = inside[: len(mesh.points)]
    return np.flatnonzero(joins)
