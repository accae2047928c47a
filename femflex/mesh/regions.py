"""Groups of a mesh by place: boxes, nearest points, points by number, single new points; and of the whole mesh."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh

WHOLE: dict[str, int | None] = {"all": None, "all_lines": 1, "all_surfaces": 2, "all_solids": 3}
ROUNDING = 1e-9  # of the mesh's size, by which a box is wider than it says


def with_whole(mesh: Mesh, names: Iterable[str]) -> Mesh:
    """The mesh with those of the names that are of whole groups and that it does not have itself.

    "all": all cells of the highest dimension; "all_lines", "all_surfaces", "all_solids": all of theirs.
    """
    added = {}
    for name in dict.fromkeys(names):
        if name in WHOLE and name not in mesh.groups:
            wanted = WHOLE[name] or mesh.dimension
            found = {kind: np.arange(len(c)) for kind, c in mesh.cells.items() if CELL_TYPES[kind].dimension == wanted}
            if found:
                added[name] = found
    return mesh.with_groups(cells=added) if added else mesh


def with_box(mesh: Mesh, name: str, low: ArrayLike, high: ArrayLike, within: str | None = None) -> Mesh:
    """The mesh with the points in a box from low to high (3,) [m] as a group, and all cells between these points.

    within: a group whose points alone count. Raises ValueError where no point lies in the box.
    """
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    a, b = np.minimum(low, high) - ROUNDING * size, np.maximum(low, high) + ROUNDING * size
    inside = np.all((mesh.points >= a) & (mesh.points <= b), axis=1)
    if within is not None:
        own = np.zeros(len(inside), bool)
        own[mesh.group_points(within)] = True
        inside &= own
    if not inside.any():
        where = "" if within is None else f" of group {within!r}"
        least, most = mesh.points.min(axis=0).tolist(), mesh.points.max(axis=0).tolist()
        raise ValueError(
            f"no point{where} lies in the box of region {name!r} from {list(low)} to {list(high)} m; the mesh reaches "  # type: ignore[arg-type]
            f"from {least} to {most} m"
        )
    cells = {kind: np.flatnonzero(inside[nodes].all(axis=1)) for kind, nodes in mesh.cells.items()}
    if within is not None and within in mesh.cell_groups:
        cells = {kind: np.intersect1d(rows, mesh.cell_groups[within].get(kind, [])) for kind, rows in cells.items()}
    cells = {kind: rows for kind, rows in cells.items() if len(rows)}
    points = {name: np.flatnonzero(inside)}
    return mesh.with_groups(cells={name: cells} if cells else None, points=points)


def with_points(mesh: Mesh, name: str, numbers: ArrayLike) -> Mesh:
    """The mesh with points of these numbers (k,), from 1 in the order of the file, as a group."""
    given = np.asarray(numbers, np.int64)
    if not given.size or given.min() < 1 or given.max() > len(mesh.points):
        raise ValueError(f"region {name!r} names points {given.tolist()}; the mesh has points 1 to {len(mesh.points)}")
    return mesh.with_groups(points={name: given - 1})


def with_point_at(mesh: Mesh, name: str, position: ArrayLike) -> Mesh:
    """The mesh with one more point, at position (3,) [m], alone in the group `name`; no cell has it."""
    at = np.asarray(position, float).reshape(1, 3)
    return replace(mesh, points=np.concatenate([mesh.points, at])).with_groups(points={name: [len(mesh.points)]})
