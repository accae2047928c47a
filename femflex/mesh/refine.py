"""Uniform subdivision: every cell is divided in two along each edge; groups are kept.

A pyramid divides into six pyramids, one at each corner and one upside down in the middle, and four tetrahedra between
them.

The positions of new points follow from the cell's shape functions at the middles (and quarters) of its unit cell, so
that curved cells stay curved. Points shared by neighbours are identified by a key: the weights of the point on the
corners of its cell, which involve only the corners of its edge or face.

Groups of cells pass to the children exactly. A new point joins a group of points if all nodes of the smallest edge,
face or cell that contains it belong to the group: the middle of an edge between two points of a group joins it, and
groups of single points do not change. If two boundaries of one group are a single cell apart, the edges that cross from
one to the other join as well; define such boundaries as groups of cells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

WEIGHT_STEPS = 64  # corner weights of all new points are whole multiples of 1/64; in pyramids they are rounded to such
WEIGHT_ROUNDING = 1e-9  # corner weights below this are rounding

WORKING_MEMORY = 8.0  # memory used while refining, relative to the refined mesh (measured)


def check_memory(mesh: Mesh, times: int) -> None:
    """Raise ValueError if refining `times` times needs more memory than is free; warn above one GB."""
    repetitions, cells, memory = min(times, 60), 0.0, 0.0  # 60: beyond any memory, within floats
    for cell, nodes in mesh.cells.items():
        count = len(nodes) * 2.0 ** (repetitions * CELL_TYPES[cell].dimension)
        cells += count
        memory += 8 * nodes.shape[1] * count
    memory += 24 * len(mesh.points) * 2.0 ** (repetitions * mesh.dimension)
    if times:
        task = f"a mesh of {sum(map(len, mesh.cells.values()))} cells refined {times} times to {cells:.3g}"
        require_memory(WORKING_MEMORY * memory, task, "refine it less often.")


def refined(mesh: Mesh, times: int = 1) -> Mesh:
    """The mesh with every cell divided in two along each edge, `times` times."""
    check_memory(mesh, times)
    for _ in range(times):
        mesh = refined_once(mesh)
    return mesh


def refined_once(mesh: Mesh) -> Mesh:
    """The mesh with every cell divided in two along each edge."""
    # curved cells first: they determine the positions
    ordered = sorted(mesh.cells.items(), key=lambda item: -CELL_TYPES[item[0]].order)
    points, rows = points_at(mesh, marks_of(mesh), [(cell, nodes, _lattice(cell)) for cell, nodes in ordered])
    lattices = {cell: part for (cell, _), part in zip(ordered, rows, strict=True)}
    cells: dict[str, list[IntArray]] = {}
    children_of: dict[
        str, list[tuple[str, int, int]]
    ] = {}  # by type of the parent: type, first row and number of children
    for cell, nodes in mesh.cells.items():
        children_of[cell] = []
        for kind, children in _children(cell, mesh.points[nodes], lattices[cell]).items():
            new_cells = cells.setdefault(kind, [])
            children_of[cell].append((kind, sum(map(len, new_cells)), children.shape[1]))
            new_cells.append(children.reshape(-1, children.shape[2]))
    cell_groups = {group: _group_of_children(by_type, children_of) for group, by_type in mesh.cell_groups.items()}
    point_groups = {
        g: _extended_group(mesh, members, lattices, len(points)) for g, members in mesh.point_groups.items()
    }
    joined = {kind: np.concatenate(parts) for kind, parts in cells.items()}
    return replace(mesh, points=points, cells=joined, cell_groups=cell_groups, point_groups=point_groups)


Part = tuple[str, IntArray, Array]  # cells of one type, their nodes (n, k), and positions (m, d) on the unit cell


def points_at(mesh: Mesh, marks: Keys, parts: Sequence[Part], strict: bool = True) -> tuple[Array, list[IntArray]]:
    """Points of the mesh with those at positions on cells, each once for all cells that share it, and for every part
    their numbers (n, m).

    strict: whether two points in the middle of one edge or face are refused
    """
    keys = [keys_of(part, marks) for part in parts]
    positions = [CELL_TYPES[cell].interpolation(on_cell) @ mesh.points[nodes] for cell, nodes, on_cell in parts]
    old_keys, old_points = _existing_points(mesh, marks, strict)
    flat = np.concatenate([np.empty(0, np.uint64), *(k.ravel() for k in keys)])
    unique, first, number = np.unique(flat, return_index=True, return_inverse=True)
    slot = np.minimum(np.searchsorted(old_keys, unique), max(len(old_keys) - 1, 0))
    is_new = old_keys[slot] != unique
    point_number = np.where(is_new, len(mesh.points) + np.cumsum(is_new) - 1, old_points[slot])
    all_positions = np.concatenate([np.empty((0, 3)), *(p.reshape(-1, 3) for p in positions)])
    rows = np.split(point_number[number.ravel()], np.cumsum([k.size for k in keys])[:-1])
    points = np.concatenate([mesh.points, all_positions[first[is_new]]])
    return points, [part.reshape(k.shape) for part, k in zip(rows, keys, strict=True)]


def refined_values(cell: str, values: Array) -> Array:
    """Values of the children of cells, from values of the cells, (e,) or (e, corners), in any unit and in the order of
    a refined group.

    Values at corners are interpolated. Valid for cells whose children have one type and one way of division.
    """
    kind = CELL_TYPES[cell]
    (children,) = _cuts(kind)
    if values.ndim == 1:
        return np.repeat(values, len(children))
    # child, corner, parent's
    weights = np.stack([CELL_TYPES[kind.corner].interpolation(corners) for corners in children])
    return np.asarray(np.einsum("nck,ek->enc", weights, values).reshape(-1, weights.shape[1]))


def _group_of_children(
    by_type: Mapping[str, IntArray], children_of: dict[str, list[tuple[str, int, int]]]
) -> dict[str, IntArray]:
    """Rows of the children of a group of cells, by their type."""
    rows_by_type: dict[str, list[IntArray]] = {}
    for cell, rows in by_type.items():
        for kind, start, count in children_of[cell]:
            rows_by_type.setdefault(kind, []).append((start + rows[:, None] * count + np.arange(count)).ravel())
    return {kind: np.concatenate(parts) for kind, parts in rows_by_type.items()}


def marks_of(mesh: Mesh) -> Keys:
    """Random marks (n_points,) of the points, from which the keys of new points are computed.

    A middle node of a cell that is a corner of another cell (two line cells along an edge of a nine-node shell) gets
    the mean of the marks of its corners, so that both cells compute the same keys. Marks are multiples of eight, which
    makes the mean exact.
    """
    marks = np.random.default_rng(0).integers(1, 2**63, len(mesh.points), dtype=np.uint64) & ~np.uint64(7)
    corners = np.zeros(len(mesh.points), bool)
    for cell, nodes in mesh.cells.items():
        corners[nodes[:, : CELL_TYPES[cell].n_corners]] = True
    for cell, nodes in mesh.cells.items():
        kind = CELL_TYPES[cell]
        for node, parents in enumerate(kind.parents, kind.n_corners):
            is_corner = corners[nodes[:, node]]
            if is_corner.any() and len(parents) in (2, 4, 8):
                shares = marks[nodes[is_corner][:, list(parents)]] // np.uint64(len(parents))
                marks[nodes[is_corner, node]] = shares.sum(axis=1, dtype=np.uint64)
    return marks


def keys_of(part: Part, marks: Keys) -> Keys:
    """Keys (n, m) of positions on cells: the weighted sum, modulo 2^64, of random marks of the corners.

    Two different points share a key with probability 2^-64.
    """
    cell, nodes, positions = part
    kind = CELL_TYPES[cell]
    weights = np.rint(CELL_TYPES[kind.corner].interpolation(positions) * WEIGHT_STEPS).astype(np.uint64)
    corners = marks[nodes[:, : kind.n_corners]]
    total = np.zeros((len(nodes), len(positions)), np.uint64)
    for corner in range(kind.n_corners):
        total += corners[:, corner, None] * weights[None, :, corner]
    return total


def _existing_points(mesh: Mesh, marks: Keys, strict: bool) -> tuple[Keys, IntArray]:
    """Sorted keys of the existing points of cells, and the numbers of these points."""
    keys = [keys_of((cell, nodes, CELL_TYPES[cell].nodes), marks).ravel() for cell, nodes in mesh.cells.items()]
    points = [nodes.ravel() for nodes in mesh.cells.values()]
    pairs_key = np.concatenate([np.empty(0, np.uint64), *keys])
    pairs_point = np.concatenate([np.empty(0, np.int64), *points])
    unique, first, inverse = np.unique(pairs_key, return_index=True, return_inverse=True)
    differ = pairs_point[first][inverse.ravel()] != pairs_point
    if strict and differ.any():
        a, b = pairs_point[first][inverse.ravel()][differ][0], pairs_point[differ][0]
        raise ValueError(
            f"points {a} and {b} are both the middle of one edge or face: two curved cells there share their corners "
            "but not their middles. Such cells cannot be subdivided; mesh them finer."
        )
    return unique, pairs_point[first]


@cache
def _lattice(cell: str) -> Array:
    """Positions (m, d) on the unit cell of all nodes of all its possible children."""
    nodes = np.concatenate([child for option in _child_nodes(cell) for _, child in option])
    return np.asarray(nodes[np.unique(np.round(nodes, 12), axis=0, return_index=True)[1]])


@cache
def _child_nodes(cell: str) -> list[list[tuple[str, Array]]]:
    """Type and node positions (k, d) of the children, for each way of division (three for tetrahedra)."""
    kind = CELL_TYPES[cell]
    return [[_child(kind, corners) for corners in option] for option in _cuts(kind)]


def _child(kind: CellType, corners: Array) -> tuple[str, Array]:
    """Type of the child of a cell with corners (c, d) and its nodes (k, d) on the unit cell of the parent."""
    child = kind
    if kind.shape == "pyramid" and len(corners) == 4:
        child = CELL_TYPES["tetra10" if kind.order == 2 else "tetra"]
    nodes = CELL_TYPES[child.corner].interpolation(child.nodes) @ corners
    return child.name, _in_cube(nodes) if kind.shape == "pyramid" else nodes


def _cuts(kind: CellType) -> list[list[Array]]:
    """Corner positions of the children, for each way of division; for pyramids in x, y, z, not in their cube."""
    corners = kind.nodes[: kind.n_corners]
    halves = [(corners + corner) / 2 for corner in corners]
    if kind.shape == "triangle":
        return [[*halves, 0.5 - corners / 2]]
    if kind.shape == "wedge":
        rotated = np.column_stack([0.5 - corners[:, :2] / 2, corners[:, 2] / 2])
        return [[*halves, rotated, rotated + np.array([0, 0, 0.5])]]
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


def _in_cube(points: Array) -> Array:
    """Points (k, 3) in that pyramid as positions (a, b, w) of its cube."""
    w = 1.0 - points[:, 2]
    flat = points[:, [1, 0]] / np.where(w > 0, w, 1.0)[:, None]
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


def _children(cell: str, corners: Array, lattice: IntArray) -> dict[str, IntArray]:
    """Nodes (n, children, k) of the children by type; tetrahedra are cut along their shortest inner diagonal."""
    lattice_positions = _lattice(cell)
    tables: list[dict[str, IntArray]] = []
    for option in _child_nodes(cell):
        table: dict[str, list[list[int]]] = {}
        for kind, child in option:
            table.setdefault(kind, []).append(
                [int(np.argmin(np.abs(lattice_positions - node).sum(axis=1))) for node in child]
            )
        tables.append({kind: lattice[:, np.array(rows)] for kind, rows in table.items()})
    if len(tables) == 1:
        return tables[0]
    diagonals = [corners[:, list(e[0])].mean(axis=1) - corners[:, list(e[1])].mean(axis=1) for e in _OPPOSITE]
    shortest = np.argmin([np.linalg.norm(d, axis=1) for d in diagonals], axis=0)
    return {cell: np.asarray(np.stack([table[cell] for table in tables])[shortest, np.arange(len(lattice))])}


def _extended_group(mesh: Mesh, members: IntArray, lattices: dict[str, IntArray], n_points: int) -> IntArray:
    """A point group extended by the new points whose edge, face or cell has all its nodes in the group."""
    inside = np.zeros(n_points, bool)
    inside[members] = True
    is_member = np.ones(n_points, bool)
    is_member[: len(mesh.points)] = inside[: len(mesh.points)]
    for cell, nodes in mesh.cells.items():
        kind = CELL_TYPES[cell]
        weights = CELL_TYPES[kind.corner].interpolation
        # corners of the smallest edge, face or cell that contains the position
        corners_of_part = weights(_lattice(cell)) > WEIGHT_ROUNDING
        # nodes of that part
        nodes_of_part = ~((weights(kind.nodes) > WEIGHT_ROUNDING)[None] & ~corners_of_part[:, None]).any(axis=2)
        missing = (~inside[nodes]).astype(np.int64) @ nodes_of_part.T.astype(np.int64) > 0
        is_member[lattices[cell][missing]] = False
    is_member[: len(mesh.points)] = inside[: len(mesh.points)]
    return np.flatnonzero(is_member)
