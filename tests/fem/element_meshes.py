"""Bricks and sheets cut into every type of cell, distorted, for tests of all elements alike."""

from __future__ import annotations

import numpy as np

from femflex.mesh import Mesh, box, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.raised import raised

SOLIDS = (
    "tetra", "tetra10", "pyramid", "pyramid13", "wedge", "wedge15", "hexahedron", "hexahedron20", "hexahedron27",
)  # fmt: skip
SECOND_ORDER = tuple(name for name in SOLIDS if CELL_TYPES[name].order == 2)
WEDGES = [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]]
PYRAMIDS = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]


def brick(cell: str, n=(2, 2, 2), size=(1.0, 0.8, 0.6), warp=0.0) -> Mesh:
    """A box of n bricks cut into cells, group "volume", bent by a smooth map of size warp; middle nodes follow it."""
    kind = CELL_TYPES[cell]
    if cell in ("hexahedron", "hexahedron20", "hexahedron27", "tetra", "tetra10"):
        mesh = box(*size, *n, cell)
        mesh = Mesh(mesh.points, {cell: mesh.cells[cell]}, {"volume": {cell: np.arange(len(mesh.cells[cell]))}})
    else:
        whole = box(*size, *n, "hexahedron")
        hexes, points = whole.cells["hexahedron"], whole.points
        if kind.shape == "wedge":
            cells = np.concatenate([hexes[:, part] for part in WEDGES])
        else:
            centre = len(points) + np.arange(len(hexes))
            points = np.concatenate([points, points[hexes].mean(axis=1)])
            cells = np.concatenate([np.column_stack([hexes[:, part], centre]) for part in PYRAMIDS])
        first = kind.corner
        mesh = Mesh(points, {first: cells}, {"volume": {first: np.arange(len(cells))}})
        if kind.order == 2:
            mesh = raised(mesh, {first: np.arange(len(cells))})
    return Mesh(bent(mesh.points, warp), mesh.cells, mesh.cell_groups)


def bent(points: np.ndarray, warp: float) -> np.ndarray:
    x, y, z = points.T
    return points + warp * np.stack([np.sin(3 * y), np.cos(2 * z) * x, x * y], axis=1)


def straight_sided(mesh: Mesh) -> Mesh:
    """The mesh with all further nodes at the means of their corners: straight edges, as patch tests want them."""
    points = np.array(mesh.points)
    for name, nodes in mesh.cells.items():
        cell = CELL_TYPES[name]
        for node, parents in enumerate(cell.parents, cell.n_corners):
            points[nodes[:, node]] = points[nodes[:, parents]].mean(axis=1)
    return Mesh(points, mesh.cells, mesh.cell_groups, mesh.point_groups)


__all__ = ["SECOND_ORDER", "SOLIDS", "bent", "brick", "rectangle", "straight_sided"]
