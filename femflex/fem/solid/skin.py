"""Drawable surface of solid members: the faces that only one element has, cut into flat triangles and quads."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import SkinPart
from femflex.mesh.cells import CELL_TYPES, FACES


def solid_skin(points: Array, cells: dict[str, IntArray], numbering: Numbering) -> SkinPart:
    """Outer faces of solids on points (n_p, 3) [m], moved by their nodes; second-order faces are cut at their middle
    nodes."""
    pieces = outer_pieces(cells)
    nodes, corners = np.unique(np.concatenate([part.ravel() for part in pieces.values()]), return_inverse=True)
    numbers = np.split(corners, np.cumsum([part.size for part in pieces.values()])[:-1])
    cols = numbering.translation_of(nodes)
    return SkinPart(
        points=points[nodes],
        cells={
            kind: numbers_of_kind.reshape(part.shape)
            for (kind, part), numbers_of_kind in zip(pieces.items(), numbers, strict=True)
        },
        rows=np.arange(3 * len(nodes)),
        cols=cols.ravel(),
        values=np.ones(3 * len(nodes)),
    )


def outer_pieces(cells: dict[str, IntArray]) -> dict[str, IntArray]:
    """Triangles (k, 3) and quads (k, 4), numbers of mesh nodes, that make up the faces which occur once,
    counterclockwise from outside."""
    keys, owner = [], []
    for name, nodes in cells.items():
        for number, face in enumerate(FACES[CELL_TYPES[name].shape]):
            sorted_nodes = np.sort(nodes[:, face], axis=1)
            keys.append(np.column_stack([sorted_nodes, np.full((len(sorted_nodes), 4 - len(face)), -1)]))
            owner.append((name, number, len(nodes)))
    _, which, count = np.unique(np.concatenate(keys), axis=0, return_inverse=True, return_counts=True)
    once = np.split(count[which.ravel()] == 1, np.cumsum([n for *_, n in owner])[:-1])
    pieces: dict[str, list[IntArray]] = {}
    for (name, number, _), outer in zip(owner, once, strict=True):
        for piece in _pieces(name, FACES[CELL_TYPES[name].shape][number]):
            kind = "quad" if len(piece) == 4 else "triangle"
            pieces.setdefault(kind, []).append(cells[name][outer][:, piece])
    return {kind: np.concatenate(parts) for kind, parts in pieces.items()}


def _pieces(name: str, face: list[int]) -> list[list[int]]:
    """A face as flat pieces of the element's own node numbers."""
    cell = CELL_TYPES[name]
    if cell.order == 1:
        return [list(face)]
    between = {tuple(parents): cell.n_corners + k for k, parents in enumerate(cell.parents)}
    n = len(face)
    middle = [between[tuple(sorted((face[i], face[(i + 1) % n])))] for i in range(n)]
    if (centre := between.get(tuple(sorted(face)))) is not None and n == 4:
        return [[face[i], middle[i], centre, middle[i - 1]] for i in range(n)]
    return [middle, *([face[i], middle[i], middle[i - 1]] for i in range(n))]
