"""The mesh: points in space, cells of several types, and named groups of both."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.merge import compacted, fused, merged, unused
from femflex.mesh.quality import qualities, sizes
from femflex.mesh.refine import refined
from femflex.warning import PhysicsWarning

CellGroup = dict[str, IntArray]

ROTATION_TOLERANCE = 1e-9  # largest entry of C C^T - 1 that is accepted as rounding
MEASURES = (("", ""), ("length", "m"), ("area", "m^2"), ("volume", "m^3"))


@dataclass(frozen=True, eq=False)
class Mesh:
    """Points, cells by type and named groups.

    points        (n_p, 3)                                    [m]
    cells         meshio cell name -> (n_c, nodes), meshio's (VTK's) node order
    cell_groups   group name -> cell name -> rows of cells[cell name], ascending
    point_groups  group name -> rows of points, ascending

    Boundaries are groups of cells one dimension lower, as in Gmsh: the edge "root" of a panel is a group of lines. A
    cell group and a point group may share a name. All arrays are read only; changed copies are past participles.
    """

    points: Array
    cells: dict[str, IntArray]
    cell_groups: dict[str, CellGroup] = field(default_factory=dict)
    point_groups: dict[str, IntArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        points = _points(self.points)
        cells = {name: _connectivity(name, rows, len(points)) for name, rows in self.cells.items() if len(rows)}
        cell_groups = {
            group: {name: _members(group, rows, len(cells.get(name, ())), name) for name, rows in by_type.items()}
            for group, by_type in self.cell_groups.items()
        }
        point_groups = {group: _members(group, rows, len(points), "point") for group, rows in self.point_groups.items()}
        for group, by_type in cell_groups.items():
            cell_groups[group] = {name: rows for name, rows in by_type.items() if len(rows)}
        for key, value in (
            ("points", points),
            ("cells", cells),
            ("cell_groups", cell_groups),
            ("point_groups", point_groups),
        ):
            object.__setattr__(self, key, value)

    def __repr__(self) -> str:
        return f"Mesh\n{self.summary()}"

    @property
    def groups(self) -> list[str]:
        """Names of all groups, sorted."""
        return sorted({*self.cell_groups, *self.point_groups})

    @property
    def dimension(self) -> int:
        """Highest dimension of the cells: 1 lines, 2 surfaces, 3 solids, 0 points only."""
        return max((CELL_TYPES[name].dimension for name in self.cells), default=0)

    def group_points(self, name: str) -> IntArray:
        """Sorted point indices (k,) of the point group `name`, or else of all nodes of the cell group of that name."""
        cell_points = np.empty(0, np.int64)
        if name not in self.point_groups or self.cell_groups.get(name):
            parts = [rows.ravel() for rows in self.group_cells(name).values()]
            cell_points = np.unique(np.concatenate(parts))
        if name not in self.point_groups:
            return cell_points
        points = self.point_groups[name]
        if not len(points):
            raise ValueError(f"point group {name!r} of the mesh is empty; put points in it, or name another group.")
        if len(cell_points) and not np.array_equal(points, cell_points):
            warnings.warn(
                f"{name!r} names a group of {len(points)} points and another of cells with {len(cell_points)} points; "
                "the group of points is taken. Give the two different names.",
                PhysicsWarning,
                stacklevel=2,
            )
        return points

    def midside_points(self) -> IntArray:
        """Sorted indices (k,) of the points that are corners of no cell: middle nodes of cells of second order."""
        corners = [rows[:, : CELL_TYPES[kind].n_corners].ravel() for kind, rows in self.cells.items()]
        other_nodes = [rows[:, CELL_TYPES[kind].n_corners :].ravel() for kind, rows in self.cells.items()]
        return np.setdiff1d(np.concatenate([*other_nodes, []]), np.concatenate([*corners, []])).astype(np.int64)

    def group_cells(self, name: str) -> dict[str, IntArray]:
        """Connectivity (k, nodes), indices of points, by cell type of the cell group `name`."""
        if name not in self.cell_groups:
            hint = f" {name!r} is a group of points; cells are needed here." if name in self.point_groups else ""
            names = sorted(self.cell_groups) if hint else self.groups
            raise ValueError(
                f"{'cell ' if hint else ''}group {name!r} is not in the mesh; it has {names}.{hint} "
                "Name the group in the mesh file, or change the requested name."
            )
        if not self.cell_groups[name]:
            raise ValueError(f"cell group {name!r} of the mesh is empty; put cells in it, or name another group.")
        return {cell: self.cells[cell][rows] for cell, rows in self.cell_groups[name].items()}

    def nearest_point(self, position: ArrayLike) -> int:
        """Index of the point nearest to position (3,) [m]."""
        return int(np.argmin(np.linalg.norm(self.points - np.asarray(position, float), axis=1)))

    def refined(self, times: int = 1) -> Mesh:
        """The mesh with every cell divided in two along each edge, `times` times; groups are kept (see refine.py)."""
        return refined(self, times)

    def translated(self, shift: ArrayLike) -> Mesh:
        """The mesh translated by shift (3,) [m]."""
        return replace(self, points=self.points + np.asarray(shift, float).reshape(3))

    def rotated(self, rotation: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
        """The mesh turned about centre (3,) [m] by a rotation vector (3,) [rad] or a matrix C (3, 3): x -> C x."""
        C = np.asarray(rotation, float)
        if C.shape == (3,):
            C = _rodrigues(C)
        if C.shape != (3, 3) or np.abs(C @ C.T - np.eye(3)).max() > ROTATION_TOLERANCE or np.linalg.det(C) < 0:
            raise ValueError(
                "a mesh is rotated by a rotation vector (3,) in rad or an orthonormal matrix (3, 3) of determinant +1; "
                f"got shape {C.shape}" + (f", determinant {np.linalg.det(C):.6g}." if C.shape == (3, 3) else ".")
            )
        origin = np.asarray(centre, float).reshape(3)
        return replace(self, points=(self.points - origin) @ C.T + origin)

    def scaled(self, factor: float) -> Mesh:
        """The mesh enlarged by factor > 0 about the origin, e.g. 1e-3 for a file in millimetres."""
        if not (np.isfinite(factor) and factor > 0):
            raise ValueError(
                f"a mesh is scaled by a positive factor, not {factor}; mirror images turn cells inside out."
            )
        return replace(self, points=self.points * factor)

    def with_groups(
        self,
        cells: Mapping[str, Mapping[str, ArrayLike]] | None = None,
        points: Mapping[str, ArrayLike] | None = None,
    ) -> Mesh:
        """The mesh with groups added or replaced: cells {name: {cell type: rows (k,)}}, points {name: rows (k,)}."""
        cell_groups = {g: {c: np.asarray(r) for c, r in by_type.items()} for g, by_type in (cells or {}).items()}
        point_groups = {g: np.asarray(rows) for g, rows in (points or {}).items()}
        return replace(
            self,
            cell_groups={**self.cell_groups, **cell_groups},
            point_groups={**self.point_groups, **point_groups},
        )

    def merged(self, other: Mesh, tolerance: float | None = None) -> Mesh:
        """Both meshes as one; groups of the same name are united.

        With a tolerance [m], points of the result closer than it become one point, so that the parts are joined.
        """
        mesh = merged(self, other)
        return mesh if tolerance is None else fused(mesh, tolerance)

    def compacted(self) -> Mesh:
        """The mesh without points that belong to no cell and no point group."""
        return compacted(self)

    def summary(self) -> str:
        """Readable text of several lines: points, extent, cells, groups, quality."""
        return describe(self)


def _points(values: ArrayLike) -> Array:
    points = np.array(values, np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"mesh points have shape {points.shape}; (n, 3) is needed, in metres.")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise ValueError(
            f"{len(bad)} of {len(points)} mesh points have coordinates that are not finite, "
            f"the first is point {bad[0]}: {points[bad[0]].tolist()}. Correct the mesh file."
        )
    points.flags.writeable = False
    return points


def _connectivity(name: str, values: ArrayLike, n_points: int) -> IntArray:
    if name not in CELL_TYPES:
        raise ValueError(f"cell type {name!r} is not understood; known are {sorted(CELL_TYPES)}.")
    rows = np.array(values, np.int64)
    n_nodes = len(CELL_TYPES[name].nodes)
    if rows.ndim != 2 or rows.shape[1] != n_nodes:
        raise ValueError(f"cells {name!r} have shape {rows.shape}; (n, {n_nodes}) is needed.")
    if rows.min() < 0 or rows.max() >= n_points:
        raise ValueError(
            f"cells {name!r} use points {rows.min()} to {rows.max()}, but the mesh has points 0 to {n_points - 1}."
        )
    rows.flags.writeable = False
    return rows


def _members(group: str, values: ArrayLike, count: int, item: str) -> IntArray:
    indices = np.asarray(values)
    if indices.size and indices.dtype.kind not in "iu":
        raise ValueError(f"group {group!r} must hold integer indices of {item}s, not values of type {indices.dtype}.")
    rows = np.unique(indices.astype(np.int64))
    if len(rows) and (rows[0] < 0 or rows[-1] >= count):
        raise ValueError(
            f"group {group!r} names {item} {rows[-1] if rows[0] >= 0 else rows[0]}, but there are {count}."
        )
    rows.flags.writeable = False
    return rows


def _rodrigues(vector: Array) -> Array:
    """Rotation matrix of a rotation vector [rad], from the exponential of its cross-product matrix."""
    angle = float(np.linalg.norm(vector))
    cross = np.cross(np.eye(3), vector)  # cross @ x = vector x x
    half = np.sinc(angle / 2 / np.pi)  # sin(angle / 2) / (angle / 2)
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * cross @ cross)


def describe(mesh: Mesh) -> str:
    """Text of several lines: points, extent, cells by type with size and quality, groups with what they hold."""
    if not len(mesh.points):
        return "points  0"
    loose = len(unused(mesh))
    lines = [f"points  {len(mesh.points)}" + (f", {loose} of them in no cell" if loose else "")]
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    lines += [
        "extent  " + "   ".join(f"{axis} {a:.6g} .. {b:.6g} m" for axis, a, b in zip("xyz", low, high, strict=True))
    ]
    return "\n".join([*lines, "cells", *_cells(mesh), "groups of cells", *_cell_groups(mesh), *_point_groups(mesh)])


def _size_of(mesh: Mesh, cell: str, nodes: IntArray) -> tuple[str, Array]:
    """The total length, area or volume of cells in words, "" of points; and the size (n,) of each."""
    size = np.abs(sizes(mesh.points, cell, nodes))
    measure, unit = MEASURES[CELL_TYPES[cell].dimension]
    return f"{measure} {size.sum():.6g} {unit}" if measure else "", size


def _cells(mesh: Mesh) -> list[str]:
    lines = []
    for cell, nodes in mesh.cells.items():
        text, size = _size_of(mesh, cell, nodes)
        text += f", each {size.min():.4g} .. {size.max():.4g}" if text else ""
        if CELL_TYPES[cell].dimension > 1:
            quality = qualities(mesh.points, cell, nodes)
            position = ", ".join(f"{x:.4g}" for x in mesh.points[nodes[int(np.argmin(quality))]].mean(axis=0))
            text += f"; quality {quality.mean():.2f}, worst {quality.min():.2f} at ({position})"
        lines.append(f"  {cell:<13} {len(nodes):>7}   {text}".rstrip())
    return lines


def _cell_groups(mesh: Mesh) -> list[str]:
    lines = []
    for group, by_type in sorted(mesh.cell_groups.items()):
        texts = {cell: _size_of(mesh, cell, mesh.cells[cell][rows])[0] for cell, rows in by_type.items()}
        parts = [f"{len(by_type[cell])} {cell}" + (f" ({text})" if text else "") for cell, text in texts.items()]
        points = f", {len(mesh.group_points(group))} points" if by_type and group not in mesh.point_groups else ""
        lines.append(f"  {group:<20} {', '.join(parts) or 'empty'}{points}")
    return lines or ["  none"]


def _point_groups(mesh: Mesh) -> list[str]:
    if not mesh.point_groups:
        return ["groups of points", "  none"]
    lines = ["groups of points"]
    for group, rows in sorted(mesh.point_groups.items()):
        text = f"{len(rows)} point{'s' if len(rows) != 1 else ''}" if len(rows) else "empty"
        if len(rows) == 1:
            text += " at (" + ", ".join(f"{x:.6g}" for x in mesh.points[rows[0]]) + ") m"
        lines.append(f"  {group:<20} {text}")
    return lines
