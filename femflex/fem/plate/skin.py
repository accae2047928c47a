"""Drawable skin of plates: both faces and the rim, with the middles of sides so that bending shows within elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.family import SkinPart
from femflex.fem.plate.blocks import LocalDofs

DECIMALS = 6  # of a normal: facets whose normals agree to this share their drawn points


@dataclass(frozen=True, eq=False)
class _SkinPoints:
    """Drawn points on the middle plane, and their motion.

    x       (k, 3)
    normal  (k|1, 3)
    number  (e, c)   index of the point of each corner or side of each element
    translations, rotations  raw dofs (k, 3) of the nodes whose mean motion the point follows
    along   further displacement: cols (k, m), rows (k, 3, m)
    """

    x: Array
    normal: Array
    number: IntArray
    translations: list[IntArray]
    rotations: list[IntArray]
    along: list[tuple[IntArray, Array]]


def plate_skin(points: Array, corners: IntArray, axes: Array, thickness: float, dof_map: LocalDofs) -> SkinPart:
    """Skin of plates with corners (e, c), numbers of nodes, counterclockwise about their normals; axes (1|e, 3, 3).

    A point moves by u + theta x offset. In the middle of a side u is the mean of its ends plus the element's own
    displacement relative to the straight line; theta is the mean of the ends.
    """
    nodes = _corner_points(points, corners, axes, dof_map)
    middles = _side_points(points, corners, axes, dof_map)
    n = len(nodes.x) + len(middles.x)
    triplets: list[tuple[IntArray, IntArray, Array]] = []
    x = []
    for face, sign in enumerate((1.0, -1.0)):
        for start, points_of_face in ((face * n, nodes), (face * n + len(nodes.x), middles)):
            offset = np.broadcast_to(sign * thickness / 2 * points_of_face.normal, points_of_face.x.shape)
            triplets += _motion(start, points_of_face, offset)
            x.append(points_of_face.x + offset)
    rows, cols, values = (np.concatenate([part[i] for part in triplets]) for i in range(3))
    numbers = np.concatenate([nodes.number, len(nodes.x) + middles.number], axis=1)
    return SkinPart(np.concatenate(x), _cells(numbers, n), rows, cols, values)


def _corner_points(points: Array, corners: IntArray, axes: Array, dof_map: LocalDofs) -> _SkinPoints:
    e, c = corners.shape
    first, number = _number_keys(corners.ravel(), axes, c)
    element, corner = first // c, first % c
    translation, rotation = _nodal(dof_map.dofs, element, corner, c)
    x, normal = points[corners.ravel()[first]], of_rows(axes, element)[:, 2]
    return _SkinPoints(x, normal, number.reshape(e, c), [translation], [rotation], [])


def _side_points(points: Array, corners: IntArray, axes: Array, dof_map: LocalDofs) -> _SkinPoints:
    """Middles of sides: besides the mean of the ends, normal (theta_i - theta_j) x (x_j - x_i) . normal / 8 and the
    in-plane rows of the side in the element's map, over its own dofs and the rotations of its ends."""
    e, c = corners.shape
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    first, number = _number_keys((ends[:, :, 0] * len(points) + ends[:, :, 1]).ravel(), axes, c)
    element, i = first // c, first % c
    j = (i + 1) % c
    (u_i, theta_i), (u_j, theta_j) = (_nodal(dof_map.dofs, element, end, c) for end in (i, j))
    side_axes = of_rows(axes, element)
    x_i, x_j = points[corners[element, i]], points[corners[element, j]]
    rise = np.cross(x_j - x_i, side_axes[:, 2]) / 8
    deflection = side_axes[:, 2, :, None] * rise[:, None, :]
    local = [
        3 * (c + i)[:, None] + np.arange(3),
        3 * (c + j)[:, None] + np.arange(3),
        (6 * c + 2 * i)[:, None] + np.arange(2),
    ]
    bulges = [_bulge(dof_map, element, c + i, side_axes, columns) for columns in local]
    along = [
        (theta_i, bulges[0] + deflection),
        (theta_j, bulges[1] - deflection),
        (dof_map.dofs[element[:, None], local[2]], bulges[2]),
    ]
    return _SkinPoints((x_i + x_j) / 2, side_axes[:, 2], number.reshape(e, c), [u_i, u_j], [theta_i, theta_j], along)


def _bulge(dof_map: LocalDofs, element: IntArray, function: IntArray, axes: Array, columns: IntArray) -> Array:
    """Displacement rows (k, 3, m) of in-plane functions (k,) of elements over columns (k, m) of their raw dofs."""
    X, row = (dof_map.X[0], ()) if len(dof_map.X) == 1 else (dof_map.X, (element[:, None],))
    u, v = (X[(*row, 2 * function[:, None] + i, columns)] for i in (0, 1))
    return axes[:, 0, :, None] * u[:, None] + axes[:, 1, :, None] * v[:, None]


def _motion(start: int, skin_points: _SkinPoints, offset: Array) -> list[tuple[IntArray, IntArray, Array]]:
    """Triplets (rows, cols, values) of u + theta x offset at points numbered from start; offset (k, 3)."""
    k = len(skin_points.x)
    rows = 3 * (start + np.arange(k))[:, None] + np.arange(3)
    share = 1 / len(skin_points.translations)
    triplets = [(rows.ravel(), cols.ravel(), np.full(3 * k, share)) for cols in skin_points.translations]
    for axis, (b, c) in enumerate(((1, 2), (2, 0), (0, 1))):  # (theta x r)_a = theta_b r_c - theta_c r_b
        for by, r in ((b, share * offset[:, c]), (c, -share * offset[:, b])):
            if r.any():
                triplets += [(rows[:, axis], theta[:, by], r) for theta in skin_points.rotations]
    for cols, values in skin_points.along:
        moving = np.argwhere(values.any(axis=0))
        triplets += [(rows[:, axis], cols[:, dof], values[:, axis, dof]) for axis, dof in moving]
    return triplets


def of_rows(table: Array, rows: IntArray) -> Array:
    """Rows (k, ...) of a table (e|1, ...) in its unit; the single row, once, of a table that all elements share."""
    return table if len(table) == 1 else table[rows]


def _nodal(dofs: IntArray, element: IntArray, corner: IntArray, c: int) -> tuple[IntArray, IntArray]:
    """Raw dofs (k, 3) of the translations and (k, 3) of the rotations of corners."""
    columns = 3 * corner[:, None] + np.arange(3)
    return dofs[element[:, None], columns], dofs[element[:, None], 3 * c + columns]


def _number_keys(keys: IntArray, axes: Array, c: int) -> tuple[IntArray, IntArray]:
    """First occurrence and number of each key (e c,) on each plane."""
    if len(axes) > 1:
        _, plane = np.unique(np.round(axes[:, 2], DECIMALS), axis=0, return_inverse=True)
        keys = keys * (int(plane.max()) + 1) + np.repeat(plane, c)
    _, first, number = np.unique(keys, return_index=True, return_inverse=True)
    return first, number


def _cells(numbers: IntArray, n: int) -> dict[str, IntArray]:
    """Faces and rim from the points of each element, corners then sides (e, 2 c); the lower face starts at n.

    Each element is cut at the middles of its sides into a triangle at every corner and the rest.
    """
    c = numbers.shape[1] // 2
    tips = [numbers[:, [i, c + i, c + (i - 1) % c]] for i in range(c)]
    cells: dict[str, list[IntArray]] = {"triangle": tips, "quad": []}
    cells["triangle" if c == 3 else "quad"].append(numbers[:, c:])
    cells_of_faces = {name: [*part, *(p[:, ::-1] + n for p in part)] for name, part in cells.items()}
    cells_of_faces["quad"] += _rim(numbers, n)
    return {name: np.concatenate(part) for name, part in cells_of_faces.items()}


def _rim(numbers: IntArray, n: int) -> list[IntArray]:
    """Quadrilaterals between the faces along the sides that one element of a plane has."""
    c = numbers.shape[1] // 2
    middle = numbers[:, c:].ravel()
    count = np.bincount(middle)
    outer = count[middle] == 1
    start, end = numbers[:, :c].ravel()[outer], np.roll(numbers[:, :c], -1, axis=1).ravel()[outer]
    mid = middle[outer]
    return [np.stack([b, a, a + n, b + n], axis=1) for a, b in ((start, mid), (mid, end))]
