"""Structured meshes of lines, rectangles, annuli and boxes with named boundaries.

Boundaries are groups of cells one dimension lower (lines round a surface counterclockwise, outward faces round a
solid); corners and ends are groups of one point.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh

ARC_SAMPLES = 4000  # number of chords used to measure the length of a curve
LINES = ("line", "line3")
EDGE_OF = {"triangle": "line", "triangle6": "line3", "quad": "line", "quad8": "line3", "quad9": "line3"}
FACE_OF = {
    "hexahedron": "quad",
    "hexahedron20": "quad8",
    "hexahedron27": "quad9",
    "tetra": "triangle",
    "tetra10": "triangle6",
}
# The two triangles of a square by either diagonal, and the six tetrahedra of a cube (Kuhn) round its main diagonal.
_RISING = [np.array([(0, 0), (1, 0), (1, 1)]), np.array([(0, 0), (1, 1), (0, 1)])]
_FALLING = [np.array([(0, 0), (1, 0), (0, 1)]), np.array([(1, 0), (1, 1), (0, 1)])]


def line(path: ArrayLike | Callable[[float], ArrayLike], n: int, cell: str = "line") -> Mesh:
    """Mesh of n line cells along a path; groups "line" (cells), "start" and "end" (points).

    path  (k, 3) points of a polyline [m], its corners become nodes; or a curve, s in [0, 1] -> (3,) [m]
    n     number of cells, of equal length on a curve and on each leg of a polyline
    cell  "line" or "line3" (second order, its middle nodes on the curve)
    """
    _check_cell(cell, LINES)
    _check_counts(n=n)
    order = CELL_TYPES[cell].order
    points = _along_curve(path, n * order) if callable(path) else _along_polyline(np.asarray(path, float), n, order)
    lattice = np.arange(len(points))
    cells = _brick_nodes(lattice, order, CELL_TYPES[cell].nodes)
    return Mesh(points, {cell: cells}, {"line": _all_rows(cell, cells)}, {"start": lattice[:1], "end": lattice[-1:]})


def rectangle(length: float, width: float, n_length: int, n_width: int, cell: str = "triangle") -> Mesh:
    """Mesh of the rectangle 0 <= x <= length, 0 <= y <= width [m] in the plane z = 0.

    Cells: triangle, triangle6 (two per square, diagonals alternating), quad, quad8, quad9. Groups: "surface"; edges
    "left" (x = 0), "right", "bottom" (y = 0), "top"; corner points "bottom_left", "bottom_right", "top_right",
    "top_left".
    """
    _check_cell(cell, EDGE_OF)
    _check_sizes(length=length, width=width)
    _check_counts(n_length=n_length, n_width=n_width)
    order = CELL_TYPES[cell].order
    points, lattice = _lattice([length, width], [n_length * order, n_width * order])
    edges = {"left": lattice[0, ::-1], "right": lattice[-1], "bottom": lattice[:, 0], "top": lattice[::-1, -1]}
    corners = {"bottom_left": (0, 0), "bottom_right": (-1, 0), "top_right": (-1, -1), "top_left": (0, -1)}
    return _surface(points, lattice, cell, edges, {name: lattice[index] for name, index in corners.items()})


def annulus(inner: float, outer: float, n_radial: int, n_around: int, cell: str = "triangle") -> Mesh:
    """Mesh of the ring inner <= r <= outer [m] round the z axis in the plane z = 0.

    Cells as for rectangle; second-order nodes lie on their circles. Groups: "surface"; edges "inner", "outer".
    """
    _check_cell(cell, EDGE_OF)
    _check_sizes(inner=inner, outer=outer)
    _check_counts(n_radial=n_radial)
    if not inner < outer:
        raise ValueError(f"an annulus needs inner < outer; got inner {inner} and outer {outer} m.")
    if n_around < 3:
        raise ValueError(f"n_around is {n_around}; an annulus needs at least 3 cells around.")
    order = CELL_TYPES[cell].order
    radius = np.linspace(inner, outer, n_radial * order + 1)
    angle = 2 * np.pi * np.arange(n_around * order) / (n_around * order)
    grid = np.stack([np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))], axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros(len(grid))])
    lattice = np.arange(radius.size * angle.size).reshape(radius.size, angle.size)
    lattice = np.concatenate([lattice, lattice[:, :1]], axis=1)
    return _surface(points, lattice, cell, {"inner": lattice[0, ::-1], "outer": lattice[-1]}, {})


def box(
    length: float, width: float, height: float, n_length: int, n_width: int, n_height: int, cell: str = "hexahedron"
) -> Mesh:
    """Mesh of the box 0 <= x <= length, 0 <= y <= width, 0 <= z <= height [m].

    Cells: hexahedron, hexahedron20, hexahedron27, tetra, tetra10 (six per brick). Groups: "volume"; faces "left"
    (x = 0), "right", "front" (y = 0), "back", "bottom" (z = 0), "top".
    """
    _check_cell(cell, FACE_OF)
    _check_sizes(length=length, width=width, height=height)
    _check_counts(n_length=n_length, n_width=n_width, n_height=n_height)
    kind, face = CELL_TYPES[cell], FACE_OF[cell]
    points, lattice = _lattice([length, width, height], [n * kind.order for n in (n_length, n_width, n_height)])
    parts = _kuhn_tetrahedra() if kind.shape == "tetra" else [None]
    cells = {cell: _brick_cells(lattice, cell, parts), face: np.empty((0, len(CELL_TYPES[face].nodes)), np.int64)}
    groups = {"volume": _all_rows(cell, cells[cell])}
    names = (("left", "right"), ("front", "back"), ("bottom", "top"))
    for axis, pair in enumerate(names):
        for side, name in zip((0, -1), pair, strict=True):
            sheet = np.take(lattice, side, axis=axis)
            if (axis == 1) == (side == -1):  # x cross z = -y
                sheet = sheet.T
            face_cells = _brick_cells(sheet, face, _RISING if kind.shape == "tetra" else [None])
            groups[name] = {face: len(cells[face]) + np.arange(len(face_cells))}
            cells[face] = np.concatenate([cells[face], face_cells])
    return Mesh(points, cells, groups).compacted()


def _along_curve(curve: Callable[[float], ArrayLike], n: int) -> Array:
    """Points (n + 1, 3) [m] on the curve, at equal steps of its arc length."""
    parameter = np.linspace(0.0, 1.0, ARC_SAMPLES + 1)
    samples = np.array([np.asarray(curve(float(s)), float).reshape(3) for s in parameter])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(samples, axis=0), axis=1))])
    parameters = np.interp(length[-1] * np.linspace(0, 1, n + 1), length, parameter)
    return np.array([np.asarray(curve(float(s)), float).reshape(3) for s in parameters])


def _along_polyline(corners: Array, n: int, order: int) -> Array:
    """Points (n + 1, 3) [m] on a polyline with n cells distributed over its legs in proportion to their length, at
    least one each."""
    if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) < 2:
        raise ValueError(f"a polyline is an array (k, 3) of at least 2 points [m]; got shape {corners.shape}.")
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if not (lengths > 0).all():
        raise ValueError(f"points {np.argmin(lengths)} and {np.argmin(lengths) + 1} of the polyline coincide.")
    if n < len(lengths):
        raise ValueError(f"a polyline of {len(lengths)} legs needs at least as many cells; n is {n}.")
    counts = np.ones(len(lengths), int)
    for _ in range(n - len(lengths)):
        counts[np.argmax(lengths / counts)] += 1  # the leg with the longest cells gets the next one
    parts = [
        a + (b - a) * (np.arange(count * order) / (count * order))[:, None]
        for a, b, count in zip(corners[:-1], corners[1:], counts, strict=True)
    ]
    return np.concatenate([*parts, corners[-1:]])


def _surface(
    points: Array, lattice: IntArray, cell: str, edges: dict[str, IntArray], corners: dict[str, IntArray]
) -> Mesh:
    """Mesh of a two-dimensional lattice with its edges (rows of lattice points) and corner points as groups."""
    if CELL_TYPES[cell].shape == "triangle":
        rising, falling = _brick_cells(lattice, cell, _RISING, False), _brick_cells(lattice, cell, _FALLING, False)
        even = np.indices(rising.shape[:2]).sum(axis=0) % 2 == 0
        cells = {cell: np.where(even[:, :, None, None], rising, falling).reshape(-1, rising.shape[-1])}
    else:
        cells = {cell: _brick_cells(lattice, cell, [None])}
    groups = {"surface": _all_rows(cell, cells[cell])}
    edge = EDGE_OF[cell]
    lines = {name: _brick_cells(row, edge, [None]) for name, row in edges.items()}
    cells[edge] = np.concatenate(list(lines.values()))
    start = 0
    for name, rows in lines.items():
        groups[name] = {edge: start + np.arange(len(rows))}
        start += len(rows)
    return Mesh(points, cells, groups, {name: np.atleast_1d(node) for name, node in corners.items()}).compacted()


def _brick_cells(lattice: IntArray, cell: str, parts: Iterable[Array | None], flat: bool = True) -> IntArray:
    """Cells (n, nodes) that fill the bricks of a lattice, each brick divided into `parts` (corner positions; None:
    undivided).

    flat False keeps the lattice's axes: (n_1, ..., part, nodes).
    """
    kind = CELL_TYPES[cell]
    first = CELL_TYPES[kind.corner].interpolation(kind.nodes)
    tables = [kind.nodes if part is None else first @ part for part in parts]
    stacked = np.stack([_brick_nodes(lattice, kind.order, table) for table in tables], axis=-2)
    return stacked.reshape(-1, stacked.shape[-1]) if flat else stacked


def _brick_nodes(lattice: IntArray, order: int, nodes: Array) -> IntArray:
    """Lattice points at positions nodes (m, d) of every brick, order lattice steps wide: (n_1, ..., n_d, m)."""
    bricks = [(size - 1) // order for size in lattice.shape]
    columns = []
    for offset in np.rint(nodes * order).astype(int):
        window = [slice(o, o + order * n, order) for o, n in zip(offset, bricks, strict=True)]
        columns.append(lattice[tuple(window)])
    return np.stack(columns, axis=-1)


def _lattice(sizes: list[float], counts: list[int]) -> tuple[Array, IntArray]:
    """Points (n, 3) of a regular lattice from the origin, and their numbers by lattice position."""
    axes = [np.linspace(0.0, size, count + 1) for size, count in zip(sizes, counts, strict=True)]
    axes += [np.zeros(1)] * (3 - len(axes))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return grid.reshape(-1, 3), np.arange(grid[..., 0].size).reshape([count + 1 for count in counts])


def _kuhn_tetrahedra() -> list[Array]:
    """Corners (4, 3) of the six positively turned tetrahedra from (0, 0, 0) to (1, 1, 1) along the cube's edges."""
    tetrahedra = []
    for axes in permutations(range(3)):
        corners = np.concatenate([np.zeros((1, 3)), np.cumsum(np.eye(3)[list(axes)], axis=0)])
        if np.linalg.det(corners[1:]) < 0:
            corners = corners[[0, 2, 1, 3]]
        tetrahedra.append(corners)
    return tetrahedra


def _all_rows(cell: str, rows: IntArray) -> dict[str, IntArray]:
    return {cell: np.arange(len(rows))}


def _check_cell(cell: str, supported: Iterable[str]) -> None:
    if cell not in supported:
        raise ValueError(f"cell {cell!r} is not made by this generator; it makes {sorted(supported)}.")


def _check_counts(**numbers: int) -> None:
    for name, value in numbers.items():
        if int(value) != value or value < 1:
            raise ValueError(f"{name} is {value}; a mesh needs a whole number of cells, at least 1.")


def _check_sizes(**sizes: float) -> None:
    for name, value in sizes.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} is {value} m; it must be finite and positive.")
