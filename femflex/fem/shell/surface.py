"""Shells on a surface that is given by its equation F(x, y, z) = 0: nodes are moved onto it, and its normals are the
directors.

A cylinder is "x**2 + y**2 - R**2", a sphere "x**2 + y**2 + z**2 - R**2", a paraboloid "x**2 + y**2 - 4 * F * z" and a
graph "z - f(x, y)", with numbers for R and F. A node moves along the normal by Newton's method,
x - F grad F / |grad F|^2; this also moves middle nodes on chords, and nodes of a refined mesh, onto the surface.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, IntArray
from femflex.fem.family import SkinPart, member_options
from femflex.fem.formula import formula_of_position
from femflex.mesh.cells import CELL_TYPES

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

STEP = 1e-5  # of the extent, of central differences: their error is 1e-10, as that of rounding
OFF = 0.1  # of the longest side at a node, that it may lie off the surface
CLOSE = 1e-10  # of the extent, within which nodes are on it
TIMES = 20  # Newton steps
PIECES = {  # flat pieces of a cell, and its rim, by its own nodes
    "triangle": [[0, 1, 2]],
    "triangle6": [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    "quad": [[0, 1, 2, 3]],
    "quad9": [[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]],
}
RIM = {
    "triangle": [0, 1, 2],
    "triangle6": [0, 3, 1, 4, 2, 5],
    "quad": [0, 1, 2, 3],
    "quad9": [0, 4, 1, 5, 2, 6, 3, 7],
}


def gradient(text: str, x: Array, extent: float) -> Array:
    """Gradient (n, 3) of the formula at positions x (n, 3), by central differences over STEP of the extent [m]."""
    h = STEP * extent
    sides = [formula_of_position(text, x + h * e) - formula_of_position(text, x - h * e) for e in np.eye(3)]
    return np.stack(sides, axis=-1) / (2 * h)


def normals(text: str, x: Array, where: str) -> Array:
    """Unit normals (n, 3) of the surface at positions x (n, 3). Raises ValueError where it has none."""
    grad = gradient(text, x, _extent(x))
    size = np.linalg.norm(grad, axis=1)
    if not (size > 0).all():
        position = ", ".join(f"{c:.6g}" for c in x[int(np.argmin(size))])
        raise ValueError(
            f"{where}: surface {text!r} has no normal at ({position}) m, where its gradient is zero; rewrite it"
        )
    return np.asarray(grad / size[:, None])


def move_onto_surfaces(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh with the nodes of shell members that have a `surface` moved onto it, and notes about it.

    Raises ValueError for a formula that is not understood, and for nodes that lie far off.
    """
    points, notes = mesh.points.copy(), []
    for member in members:
        text = member_options(member)["surface"] if member.family == "shell" else None
        if text is None:
            continue
        where = f"shell on group {member.group!r}"
        if not isinstance(text, str):
            raise ValueError(f"{where} has surface {text!r}; give a formula of x, y and z that is zero on the surface")
        cells = mesh.group_cells(member.group)
        nodes = np.unique(np.concatenate([rows.ravel() for rows in cells.values()]))
        try:
            projected = _project(text, points[nodes], where)
        except ValueError as error:
            raise ValueError(str(error) if where in str(error) else f"{where}: surface: {error}") from None
        distance = np.linalg.norm(projected - points[nodes], axis=1)
        side = np.zeros(len(points))
        for name, rows in cells.items():
            x = points[rows[:, : CELL_TYPES[name].n_corners]]
            longest = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1)
            np.maximum.at(side, rows, longest[:, None])
        too_far = distance > OFF * side[nodes]
        if too_far.any():
            worst = int(np.argmax(distance / side[nodes]))
            position = ", ".join(f"{c:.6g}" for c in points[nodes[worst]])
            raise ValueError(
                f"{where}: {int(too_far.sum())} of {len(nodes)} nodes lie off the surface {text!r}, the node at "
                f"({position}) m by {distance[worst]:.3g} m, over {OFF:.0%} of its element's side; correct the formula "
                "or leave it out"
            )
        points[nodes] = projected
        if distance.max() > CLOSE * _extent(points[nodes]):
            count = int((distance > CLOSE * _extent(points[nodes])).sum())
            notes.append(
                f"{count} of {len(nodes)} nodes of {where} are moved onto its surface, by up to {distance.max():.3g} m"
            )
    return (replace(mesh, points=points), tuple(notes)) if notes else (mesh, ())


def _project(text: str, x: Array, where: str) -> Array:
    extent, start = _extent(x), x
    for _ in range(TIMES):
        grad = gradient(text, x, extent)
        square = np.sum(grad**2, axis=1)
        if not (square > 0).all():
            normals(text, x, where)
        step = (formula_of_position(text, x) / square)[:, None] * grad
        x = x - step
        if np.abs(step).max() < 1e-13 * extent:
            break
        if np.linalg.norm(x - start, axis=1).max() > extent:
            break
    return x


def _extent(x: Array) -> float:
    return float(np.linalg.norm(np.ptp(x, axis=0))) or 1.0


def shell_skin(
    points: Array, cells: dict[str, IntArray], surface: Directors, thickness: float, dofs: dict[str, IntArray]
) -> SkinPart:
    """Skin of shells of that thickness [m] on points (n_p, 3) [m]; a point moves by u + theta x offset."""
    n = len(surface.node)
    moves, turns = np.full((n, 3), -1, np.int64), np.full((n, 3), -1, np.int64)
    faces: dict[str, list[IntArray]] = {"quad": [], "triangle": []}
    ends, sides = [], []
    for name, nodes in cells.items():
        e, k = nodes.shape
        number = surface.number[name]
        moves[number] = dofs[name][:, : 3 * k].reshape(e, k, 3)
        turns[number] = dofs[name][:, 3 * k :].reshape(e, k, 3)
        # a director that neighbours share may point to either side of an element, so each node is checked
        below = np.sum(surface.V[name] * surface.vector[number], axis=2) < 0
        upper, lower = number + n * below, number + n * ~below
        for piece in PIECES[name]:
            kind = "quad" if len(piece) == 4 else "triangle"
            faces[kind] += [upper[:, piece], lower[:, piece[::-1]]]
        ring = RIM[name]
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            ends.append(np.sort(number[:, [a, b]], axis=1))
            sides.append(np.stack([upper[:, b], upper[:, a], lower[:, a], lower[:, b]], axis=1))
    _, first, count = np.unique(np.concatenate(ends), axis=0, return_index=True, return_counts=True)
    faces["quad"].append(np.concatenate(sides)[np.sort(first[count == 1])])
    x, rows, cols, values = [], [], [], []
    for face, sign in enumerate((1.0, -1.0)):
        offset = sign * thickness / 2 * surface.vector
        x.append(points[surface.node] + offset)
        row = 3 * (face * n + np.arange(n)[:, None]) + np.arange(3)
        lever = np.cross(np.eye(3), offset[:, None]).swapaxes(1, 2)  # (n, i, j): (theta x offset)_i
        rows += [row.ravel(), np.repeat(row, 3, axis=1).ravel()]
        cols += [moves.ravel(), np.tile(turns, (1, 3)).ravel()]
        values += [np.ones(moves.size), lever.ravel()]
    cells_drawn = {kind: np.concatenate(parts) for kind, parts in faces.items() if parts}
    return SkinPart(np.concatenate(x), cells_drawn, np.concatenate(rows), np.concatenate(cols), np.concatenate(values))


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
