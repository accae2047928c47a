"""Loads on elements of a deck while it is read: on lines and beams, on surfaces, and on faces of solids."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.decks.builder import Builder
from femflex.fem.static_loads import StaticLoads
from femflex.mesh.cells import CELL_TYPES, side_of

Cell = tuple[str, int]  # cell type and row


def cells_of(build: Builder, number: int, dimension: int) -> list[Cell]:
    """The cells of an element. Raises ValueError where it has none of that dimension."""
    cells = [cell for cell in build.cell_of.get(number, ()) if CELL_TYPES[cell[0]].dimension == dimension]
    if not cells:
        kind = ("line", "surface", "solid")[dimension - 1]
        raise ValueError(f"an element that it names is no {kind} of the structure")
    return cells


def on_cell(build: Builder, cell: Cell, load: ArrayLike) -> StaticLoads:
    """A load on a cell: at its corners, pressures (c,) along the normal [Pa] or forces per size (c, 3)."""
    nodes = build.cells[cell[0]][cell[1]]
    return StaticLoads.on_cell(cell[0], nodes, np.array([build.points[k] for k in nodes]), load)


def on_line(build: Builder, cell: Cell, force_per_length: Array, bends: bool) -> StaticLoads:
    """An even force per length (3,) [N/m] on a line of two or three nodes, with moments at the nodes if it bends."""
    nodes = build.cells[cell[0]][cell[1]]
    chain = nodes if len(nodes) == 2 else [nodes[0], nodes[2], nodes[1]]
    parts = [
        StaticLoads.on_beam(ends, np.array([build.points[k] for k in ends]), force_per_length)
        for ends in pairwise(chain)
    ]
    loads = StaticLoads.combined((1.0, part) for part in parts)
    return loads if bends else StaticLoads.at_points(loads.points, loads.forces)


def on_face(build: Builder, cell: Cell, corners: Sequence[int], load: ArrayLike) -> StaticLoads:
    """A load on the face of a solid between corners of the cell: pressures (c,) there, inwards [Pa], or forces per
    area (c, 3)."""
    kind, row = CELL_TYPES[cell[0]], cell[1]
    solid, values = build.cells[cell[0]][row], np.asarray(load, float)
    face, local = side_of(kind, corners)
    x = np.array([build.points[k] for k in solid])
    if values.ndim == 1:
        normal = np.cross(x[corners[1]] - x[corners[0]], x[corners[2]] - x[corners[0]])
        inwards = x[: kind.n_corners].mean(axis=0) - x[list(corners)].mean(axis=0)
        values = values * np.sign(normal @ inwards)
    return StaticLoads.on_cell(face, [solid[j] for j in local], x[local], values)
