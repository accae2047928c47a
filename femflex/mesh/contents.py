"""What a mesh file holds, as its reader finds it, and the way from there to a Mesh.

Readers differ in how groups are reported; they all end in blocks of cells with group names, point groups and a count of
elements that were not understood. What is common is done here: blocks of one type are joined, single-point cells become
point groups, unknown cells are left out with a report, points used by nothing are dropped.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import CellGroup, Mesh
from femflex.warning import PhysicsWarning


@dataclass(frozen=True, eq=False)
class Block:
    """Cells of one type: meshio name, nodes (n, k) as rows of the points, and group name -> rows of this block."""

    cell: str
    nodes: IntArray
    groups: dict[str, IntArray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Contents:
    """Points (n, 2|3), blocks, point groups; names wanted instead of default ones; left-out elements by type."""

    points: Array
    blocks: list[Block]
    point_groups: dict[str, IntArray] = field(default_factory=dict)
    empty: tuple[str, ...] = ()  # groups the file names but fills with nothing
    titles: dict[str, str] = field(default_factory=dict)
    left_out: Mapping[str, int] = field(default_factory=dict)


def to_mesh(contents: Contents, source: str, strict: bool = True) -> Mesh:
    """Mesh of a file's contents; `source` is the file's name for messages.

    Raises ValueError where no cell is left; with strict False a file without any gives a mesh of points alone.
    """
    left_out = Counter(contents.left_out)
    blocks = [block for block in contents.blocks if block.cell in CELL_TYPES]
    for block in contents.blocks:
        if block.cell not in CELL_TYPES and len(block.nodes):
            left_out[block.cell] += len(block.nodes)
    listed = ", ".join(f"{name} ({count})" for name, count in sorted(left_out.items()))
    if left_out and blocks:
        warnings.warn(
            f"{source}: elements not understood and left out: {listed}; {sum(len(b.nodes) for b in blocks)} are kept. "
            f"Understood are {sorted(CELL_TYPES)}.",
            PhysicsWarning,
            stacklevel=3,
        )
    points = np.asarray(contents.points, float)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    _check_nodes(blocks, len(points), source)
    cells, cell_groups = _joined(blocks)
    for group in contents.empty:
        cell_groups.setdefault(group, {})
    mesh = without_vertices(Mesh(points, cells, cell_groups, dict(contents.point_groups)))
    if not mesh.cells and not strict and not left_out:
        return mesh
    if not mesh.cells:
        found = f", only {listed}" if listed else ""
        raise ValueError(f"{source} holds no elements that are understood{found}; understood are {sorted(CELL_TYPES)}.")
    return mesh.compacted()


def without_vertices(mesh: Mesh) -> Mesh:
    """The mesh with cells of a single point turned into point groups."""
    cell_groups: dict[str, CellGroup] = {}
    point_groups = dict(mesh.point_groups)
    for group, by_type in mesh.cell_groups.items():
        rest = {cell: rows for cell, rows in by_type.items() if cell != "vertex"}
        if "vertex" in by_type:
            points = mesh.cells["vertex"][by_type["vertex"]].ravel()
            point_groups[group] = np.concatenate([point_groups.get(group, points[:0]), points])
        if rest or "vertex" not in by_type:
            cell_groups[group] = rest
    for group in [g for g in cell_groups if not cell_groups[g] and g in point_groups]:
        del cell_groups[group]
    cells = {cell: rows for cell, rows in mesh.cells.items() if cell != "vertex"}
    return Mesh(mesh.points, cells, cell_groups, point_groups)


def renamed(mesh: Mesh, wanted: Mapping[str, str] | None, titles: Mapping[str, str], source: str) -> Mesh:
    """The mesh with groups renamed: `wanted` {new name: name in the file}, then the file's own `titles`.

    Groups that come to one name are united.
    """
    new: dict[str, list[str]] = {}
    keys = {_key(name): name for name in mesh.groups}
    keys |= {_key(title): name for name, title in titles.items() if name in mesh.groups}
    for name, given in (wanted or {}).items():
        if _key(given) not in keys:
            raise ValueError(
                f"{source} has no group {given!r} to be named {name!r}; it has {sorted(keys.values())}"
                f"{f' titled {sorted(titles.values())}' if titles else ''}. Correct the mapping of groups."
            )
        new.setdefault(keys[_key(given)], []).append(name)
    for name, title in titles.items():
        new.setdefault(name, [title])
    cell_groups: dict[str, CellGroup] = {}
    for group, by_type in mesh.cell_groups.items():
        for name in new.get(group, [group]):
            into = cell_groups.setdefault(name, {})
            for cell, rows in by_type.items():
                into[cell] = np.union1d(into.get(cell, rows), rows)
    point_groups: dict[str, IntArray] = {}
    for group, rows in mesh.point_groups.items():
        for name in new.get(group, [group]):
            point_groups[name] = np.union1d(point_groups.get(name, rows), rows)
    return Mesh(mesh.points, mesh.cells, cell_groups, point_groups)


def _key(name: str) -> str:
    """One spelling for "SET 4", "set 4" and "set_4"."""
    return "_".join(name.lower().split())


def _joined(blocks: list[Block]) -> tuple[dict[str, IntArray], dict[str, CellGroup]]:
    """Blocks of one type joined into one array, their group rows shifted accordingly."""
    parts: dict[str, list[IntArray]] = {}
    members: dict[str, dict[str, list[IntArray]]] = {}
    for block in blocks:
        start = sum(len(part) for part in parts.get(block.cell, []))
        parts.setdefault(block.cell, []).append(np.asarray(block.nodes, np.int64))
        for group, rows in block.groups.items():
            members.setdefault(group, {}).setdefault(block.cell, []).append(np.asarray(rows, np.int64) + start)
    cells = {cell: np.concatenate(arrays) for cell, arrays in parts.items()}
    groups = {
        group: {cell: np.concatenate(rows) for cell, rows in by_type.items()} for group, by_type in members.items()
    }
    return cells, groups


def _check_nodes(blocks: list[Block], n_points: int, source: str) -> None:
    for block in blocks:
        if len(block.nodes) and (block.nodes.min() < 0 or block.nodes.max() >= n_points):
            bad = np.flatnonzero(((block.nodes < 0) | (block.nodes >= n_points)).any(axis=1))
            raise ValueError(
                f"{source}: {len(bad)} elements of type {block.cell} use nodes that the file does not define "
                f"(it defines {n_points}). Write the mesh again from its source."
            )
