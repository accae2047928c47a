"""Drawable skin of shells: both faces and the rim, at the nodes of the elements."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.family import SkinPart
from femflex.fem.shell.directors import Directors

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
