"""A readable summary of a mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.merge import unused
from femflex.mesh.quality import qualities, sizes

if TYPE_CHECKING:
    from femflex.mesh.mesh import Mesh


MEASURES = (("", ""), ("length", "m"), ("area", "m^2"), ("volume", "m^3"))


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


def _cells(mesh: Mesh) -> list[str]:
    lines = []
    for cell, nodes in mesh.cells.items():
        dimension = CELL_TYPES[cell].dimension
        if dimension == 0:
            lines.append(f"  {cell:<13} {len(nodes):>7}")
            continue
        size = np.abs(sizes(mesh.points, cell, nodes))
        measure, unit = MEASURES[dimension]
        text = f"{measure} {size.sum():.6g} {unit}, each {size.min():.4g} .. {size.max():.4g}"
        if dimension > 1:
            quality = qualities(mesh.points, cell, nodes)
            position = mesh.points[nodes[int(np.argmin(quality))]].mean(axis=0)
            position_text = ", ".join(f"{x:.4g}" for x in position)
            text += f"; quality {quality.mean():.2f}, worst {quality.min():.2f} at ({position_text})"
        lines.append(f"  {cell:<13} {len(nodes):>7}   {text}")
    return lines


def _cell_groups(mesh: Mesh) -> list[str]:
    lines = []
    for group, by_type in sorted(mesh.cell_groups.items()):
        parts = []
        for cell, rows in by_type.items():
            dimension = CELL_TYPES[cell].dimension
            size = np.abs(sizes(mesh.points, cell, mesh.cells[cell][rows])).sum()
            measure, unit = MEASURES[dimension]
            parts.append(f"{len(rows)} {cell}" + (f" ({measure} {size:.6g} {unit})" if measure else ""))
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
