"""Bricks and sheets cut into every type of cell, distorted, for tests of all elements alike."""

from __future__ import annotations

import numpy as np

from femflex.mesh import Mesh, box, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.second_order import raise_order

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
            mesh = raise_order(mesh, {first: np.arange(len(cells))})
    return Mesh(bent(mesh.points, warp), mesh.cells, mesh.cell_groups)


def mixed_bricks(n=(3, 3, 3), seed=0) -> Mesh:
    """A box of n bricks with shaken inner nodes, at random left whole or cut.

    Columns along z are cut into wedges, single bricks into six pyramids, and those on the box's sides into tetrahedra.
    """
    rng, whole = np.random.default_rng(seed), box(1.0, 0.8, 0.6, *n, "hexahedron")
    hexes, points = whole.cells["hexahedron"], whole.points.copy()
    inner = np.ones(len(points), bool)
    for axis, size in enumerate((1.0, 0.8, 0.6)):
        inner &= np.abs(points[:, axis] - size / 2) < size / 2 - 1e-9
    points[inner] += rng.uniform(-0.04, 0.04, (int(inner.sum()), 3))
    column = np.unique(np.round(whole.points[hexes].mean(axis=1)[:, :2], 9), axis=0, return_inverse=True)[1].ravel()
    cut = (rng.random(column.max() + 1) < 0.4)[column]
    burst = ~cut & (rng.random(len(hexes)) < 0.5)
    centre = len(points) + np.arange(burst.sum())
    points = np.concatenate([points, points[hexes[burst]].mean(axis=1)])
    pyramids = np.concatenate([np.column_stack([hexes[burst][:, part], centre]) for part in PYRAMIDS])
    outside = ~inner[pyramids[:, :4]].any(axis=1)
    outside &= (np.ptp(points[pyramids[:, :4]], axis=1) < 1e-9).any(axis=1)  # the whole base lies in a side
    cells = {
        "hexahedron": hexes[~cut & ~burst],
        "wedge": np.concatenate([hexes[cut][:, part] for part in WEDGES]),
        "pyramid": pyramids[~outside],
        "tetra": np.concatenate([pyramids[outside][:, part] for part in ([0, 1, 2, 4], [0, 2, 3, 4])]),
    }
    return Mesh(points, cells, {"volume": {name: np.arange(len(own)) for name, own in cells.items()}})


def mixed_sheet(n: int = 4, seed: int = 0) -> Mesh:
    """A rectangle of n x n quadrilaterals with shaken inner nodes, at random left whole or cut along a diagonal."""
    rng, whole = np.random.default_rng(seed), rectangle(1.0, 0.8, n, n, "quad")
    points, quads = whole.points.copy(), whole.cells["quad"]
    inner = (np.abs(points[:, 0] - 0.5) < 0.49) & (np.abs(points[:, 1] - 0.4) < 0.39)
    points[inner, :2] += rng.uniform(-0.05, 0.05, (int(inner.sum()), 2))
    kind = rng.integers(0, 3, len(quads))
    halves = {1: ([0, 1, 2], [0, 2, 3]), 2: ([0, 1, 3], [1, 2, 3])}
    triangles = np.concatenate([quads[kind == k][:, part] for k, parts in halves.items() for part in parts])
    cells = {"quad": quads[kind == 0], "triangle": triangles}
    return Mesh(points, cells, {"surface": {name: np.arange(len(own)) for name, own in cells.items()}})


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


__all__ = ["SECOND_ORDER", "SOLIDS", "bent", "brick", "mixed_bricks", "mixed_sheet", "rectangle", "straight_sided"]
