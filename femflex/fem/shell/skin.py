"""Drawable skin of shells: both faces and the rim, at the nodes of the elements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.fem.family import SkinPart
from femflex.fem.shell.directors import Directors

Array = NDArray[np.float64]
Index = NDArray[np.int64]

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
    points: Array, cells: dict[str, Index], surface: Directors, thickness: float, dofs: dict[str, Index]
) -> SkinPart:
    """Skin of shells of that thickness [m] on points (n_p, 3) [m]; a point moves by u + theta x offset."""
    n = len(surface.node)
    moves, turns = np.full((n, 3), -1, np.int64), np.full((n, 3), -1, np.int64)
    found: dict[str, list[Index]] = {"quad": [], "triangle": []}
    sides = []
    for name, nodes in cells.items():
        e, k = nodes.shape
        number = surface.number[name]
        moves[number] = dofs[name][:, : 3 * k].reshape(e, k, 3)
        turns[number] = dofs[name][:, 3 * k :].reshape(e, k, 3)
        turned = np.sum(surface.V[name][:, 0] * surface.vector[number[:, 0]], axis=1) < 0
        for piece in PIECES[name]:
            kind = "quad" if len(piece) == 4 else "triangle"
            own = np.where(turned[:, None], number[:, piece[::-1]], number[:, piece])
            found[kind] += [own, own[:, ::-1] + n]
        ring = RIM[name]
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            start, end = np.where(turned, number[:, b], number[:, a]), np.where(turned, number[:, a], number[:, b])
            sides.append(np.stack([start, end], axis=1))
    every = np.concatenate(sides)
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    rim = every[np.sort(first[count == 1])]
    found["quad"].append(np.stack([rim[:, 1], rim[:, 0], rim[:, 0] + n, rim[:, 1] + n], axis=1))
    x, rows, cols, values = [], [], [], []
    for face, sign in enumerate((1.0, -1.0)):
        offset = sign * thickness / 2 * surface.vector
        x.append(points[surface.node] + offset)
        row = 3 * (face * n + np.arange(n)[:, None]) + np.arange(3)
        lever = np.cross(np.eye(3), offset[:, None]).swapaxes(1, 2)  # (n, i, j): (theta x offset)_i
        rows += [row.ravel(), np.repeat(row, 3, axis=1).ravel()]
        cols += [moves.ravel(), np.tile(turns, (1, 3)).ravel()]
        values += [np.ones(moves.size), lever.ravel()]
    cells_drawn = {kind: np.concatenate(parts) for kind, parts in found.items() if parts}
    return SkinPart(np.concatenate(x), cells_drawn, np.concatenate(rows), np.concatenate(cols), np.concatenate(values))
