"""Drawable skin of plates: both faces and the rim, with the middles of sides so that bending shows within elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.fem.family import SkinPart
from femflex.fem.plate_blocks import LocalDofs

Array = NDArray[np.float64]
Index = NDArray[np.int64]

DECIMALS = 6  # of a normal: facets that agree so far share their drawn points


@dataclass(frozen=True, eq=False)
class _Places:
    """Drawn places on the middle plane: x (k, 3), normals (k, 3), displacement and rotation rows (k, 3, m) over raw
    dofs cols (k, m), and the number of the place (e, c) that each corner or side of each element has."""

    x: Array
    normal: Array
    cols: Index
    u: Array
    theta: Array
    number: Index


def plate_skin(points: Array, corners: Index, axes: Array, thickness: float, dof_map: LocalDofs) -> SkinPart:
    """Skin of plates with corners (e, c), counterclockwise about their normals; axes (1|e, 3, 3).

    A point moves by u + theta x offset. In the middle of a side u is the mean of its ends and the element's own
    displacement beyond the straight line; theta is the mean of the ends.
    """
    nodes = _corner_places(points, corners, axes, dof_map)
    middles = _side_places(points, corners, axes, dof_map)
    places = (nodes, middles)
    n = len(nodes.x) + len(middles.x)
    numbers = np.concatenate([nodes.number, len(nodes.x) + middles.number], axis=1)
    parts, x = [], []
    for face, sign in enumerate((1.0, -1.0)):
        start = face * n
        for place in places:
            offset = sign * thickness / 2 * place.normal
            turned = np.cross(place.theta, offset[:, :, None], axis=1)  # theta x offset
            parts.append(_triplets(start, place.cols, place.u + turned))
            x.append(place.x + offset)
            start += len(place.x)
    rows, cols, values = (np.concatenate([part[i] for part in parts]) for i in range(3))
    return SkinPart(np.concatenate(x), _cells(numbers, corners, n), rows, cols, values)


def _corner_places(points: Array, corners: Index, axes: Array, dof_map: LocalDofs) -> _Places:
    e, c = corners.shape
    first, number = _shared(corners.ravel(), axes, c)
    element, corner = first // c, first % c
    cols = _nodal(dof_map.dofs, element, corner, c)
    u = np.broadcast_to(np.eye(3, 6), (len(first), 3, 6))
    theta = np.broadcast_to(np.eye(3, 6, k=3), (len(first), 3, 6))
    normal = of_rows(axes, element)[:, 2]
    return _Places(points[corners.ravel()[first]], normal, cols, u, theta, number.reshape(e, c))


def _side_places(points: Array, corners: Index, axes: Array, dof_map: LocalDofs) -> _Places:
    e, c = corners.shape
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    keys = ends[:, :, 0] * len(points) + ends[:, :, 1]
    first, number = _shared(keys.ravel(), axes, c)
    element, i = first // c, first % c
    j = (i + 1) % c
    sides = dof_map.dofs[element[:, None], 6 * c + 2 * i[:, None] + np.arange(2)]
    cols = np.concatenate([_nodal(dof_map.dofs, element, i, c), _nodal(dof_map.dofs, element, j, c), sides], axis=1)
    own = of_rows(axes, element)
    x_i, x_j = points[corners[element, i]], points[corners[element, j]]
    u = np.zeros((len(first), 3, 14))
    theta = np.zeros_like(u)
    u[:, :, :3] = u[:, :, 6:9] = theta[:, :, 3:6] = theta[:, :, 9:12] = np.eye(3) / 2
    rise = np.cross(x_j - x_i, own[:, 2]) / 8  # normal . ((theta_i - theta_j) x (x_j - x_i)) / 8
    lift = own[:, 2, :, None] * rise[:, None, :]
    u[:, :, 3:6] += lift
    u[:, :, 9:12] -= lift
    local = 3 * (c + i)[:, None] + np.arange(3), 3 * (c + j)[:, None] + np.arange(3), 6 * c + 2 * i[:, None] + np.arange(2)
    X = of_rows(dof_map.X, element)
    k = np.arange(len(first))
    for axis, row in ((own[:, 0], 2 * (c + i)), (own[:, 1], 2 * (c + i) + 1)):
        for target, columns in zip((slice(3, 6), slice(9, 12), slice(12, 14)), local, strict=True):
            u[:, :, target] += axis[:, :, None] * X[k[:, None] if len(X) > 1 else 0, row[:, None], columns][:, None]
    return _Places((x_i + x_j) / 2, own[:, 2], cols, u, theta, number.reshape(e, c))


def of_rows(table: Array, rows: Index) -> Array:
    """Rows (k, ...) of a table (e|1, ...); the single row, once, of a table that all elements share."""
    return table if len(table) == 1 else table[rows]


def _nodal(dofs: Index, element: Index, corner: Index, c: int) -> Index:
    """Raw dofs (k, 6) of the translation and rotation of corners."""
    three = np.arange(3)
    columns = np.concatenate([3 * corner[:, None] + three, 3 * (c + corner)[:, None] + three], axis=1)
    return dofs[element[:, None], columns]


def _shared(keys: Index, axes: Array, c: int) -> tuple[Index, Index]:
    """First occurrence and number of each key (e c,) on each plane."""
    if len(axes) > 1:
        _, plane = np.unique(np.round(axes[:, 2], DECIMALS), axis=0, return_inverse=True)
        keys = keys * (int(plane.max()) + 1) + np.repeat(plane, c)
    _, first, number = np.unique(keys, return_index=True, return_inverse=True)
    return first, number


def _triplets(start: int, cols: Index, rows: Array) -> tuple[Index, Index, Array]:
    """Triplets of operator rows (k, 3, m) for points numbered from start."""
    point, axis, entry = np.nonzero(rows)
    return 3 * (start + point) + axis, cols[point, entry], rows[point, axis, entry]


def _cells(numbers: Index, corners: Index, n: int) -> dict[str, Index]:
    """Faces and rim from the places of each element, corners then sides (e, 2 c); the lower face starts at n.

    Each element is cut at the middles of its sides: a triangle at every corner and what is left.
    """
    c = corners.shape[1]
    tips = [numbers[:, [i, c + i, c + (i - 1) % c]] for i in range(c)]
    cells: dict[str, list[Index]] = {"triangle": tips, "quad": []}
    cells["triangle" if c == 3 else "quad"].append(numbers[:, c:])
    both = {name: [*part, *(p[:, ::-1] + n for p in part)] for name, part in cells.items()}
    both["quad"] += _rim(numbers, n)
    return {name: np.concatenate(part) for name, part in both.items()}


def _rim(numbers: Index, n: int) -> list[Index]:
    """Quadrilaterals between the faces along the sides that one element of a plane has."""
    c = numbers.shape[1] // 2
    middle = numbers[:, c:].ravel()
    count = np.bincount(middle)
    outer = count[middle] == 1
    start, end = numbers[:, :c].ravel()[outer], np.roll(numbers[:, :c], -1, axis=1).ravel()[outer]
    mid = middle[outer]
    return [np.stack([b, a, a + n, b + n], axis=1)[:, ::-1] for a, b in ((start, mid), (mid, end))]
