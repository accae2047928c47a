"""Groups of a mesh by position: boxes, points by number, single new points; and groups of the whole mesh."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh

WHOLE_GROUPS: dict[str, int | None] = {"all": None, "all_lines": 1, "all_surfaces": 2, "all_solids": 3}
BOX_TOLERANCE = 1e-9  # enlargement of a box, relative to the size of the mesh


def with_whole_groups(mesh: Mesh, names: Iterable[str]) -> Mesh:
    """The mesh with the named groups of the whole mesh, unless it has groups of these names.

    "all": all cells of the highest dimension; "all_lines", "all_surfaces", "all_solids": all cells of that dimension.
    """
    added = {}
    for name in dict.fromkeys(names):
        if name in WHOLE_GROUPS and name not in mesh.groups:
            dimension = WHOLE_GROUPS[name] or mesh.dimension
            rows = {
                kind: np.arange(len(c)) for kind, c in mesh.cells.items() if CELL_TYPES[kind].dimension == dimension
            }
            if rows:
                added[name] = rows
    return mesh.with_groups(cells=added) if added else mesh


def with_box(mesh: Mesh, name: str, low: ArrayLike, high: ArrayLike, within: str | None = None) -> Mesh:
    """The mesh with the points in a box from low to high (3,) [m] as a group, and all cells between these points.

    within: a group that limits the points. Raises ValueError if no point lies in the box.
    """
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    a, b = np.minimum(low, high) - BOX_TOLERANCE * size, np.maximum(low, high) + BOX_TOLERANCE * size
    inside = np.all((mesh.points >= a) & (mesh.points <= b), axis=1)
    if within is not None:
        in_group = np.zeros(len(inside), bool)
        in_group[mesh.group_points(within)] = True
        inside &= in_group
    if not inside.any():
        group_text = "" if within is None else f" of group {within!r}"
        lowest, highest = mesh.points.min(axis=0).tolist(), mesh.points.max(axis=0).tolist()
        raise ValueError(
            f"no point{group_text} lies in the box of region {name!r} from {list(low)} to {list(high)} m; the mesh "  # type: ignore[arg-type]
            f"reaches from {lowest} to {highest} m"
        )
    cells = {kind: np.flatnonzero(inside[nodes].all(axis=1)) for kind, nodes in mesh.cells.items()}
    if within is not None and within in mesh.cell_groups:
        cells = {kind: np.intersect1d(rows, mesh.cell_groups[within].get(kind, [])) for kind, rows in cells.items()}
    cells = {kind: rows for kind, rows in cells.items() if len(rows)}
    points = {name: np.flatnonzero(inside)}
    return mesh.with_groups(cells={name: cells} if cells else None, points=points)


def with_points(mesh: Mesh, name: str, numbers: ArrayLike) -> Mesh:
    """The mesh with points of these numbers (k,), counted from 1 in the order of the file, as a group."""
    indices = np.asarray(numbers, np.int64)
    if not indices.size or indices.min() < 1 or indices.max() > len(mesh.points):
        raise ValueError(
            f"region {name!r} names points {indices.tolist()}; the mesh has points 1 to {len(mesh.points)}"
        )
    return mesh.with_groups(points={name: indices - 1})


def with_point_at(mesh: Mesh, name: str, position: ArrayLike) -> Mesh:
    """The mesh with one more point, at position (3,) [m], which belongs to no cell and is the only member of the group
    `name`."""
    point = np.asarray(position, float).reshape(1, 3)
    return replace(mesh, points=np.concatenate([mesh.points, point])).with_groups(points={name: [len(mesh.points)]})
