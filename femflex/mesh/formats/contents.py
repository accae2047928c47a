"""Contents of a mesh file as returned by its reader, and their conversion to a Mesh.

File formats differ in how they store groups. All readers return blocks of cells with group names, point groups and a
count of the elements of unknown type. The common steps are done here: blocks of one type are joined, single-point cells
become point groups, unknown cells are left out with a warning, and unused points are dropped.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

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
    """Points (n, 2|3), blocks, point groups; titles that replace default group names; counts of left-out elements by
    type."""

    points: Array
    blocks: list[Block]
    point_groups: dict[str, IntArray] = field(default_factory=dict)
    empty: tuple[str, ...] = ()  # groups that the file names without members
    titles: dict[str, str] = field(default_factory=dict)
    left_out: Mapping[str, int] = field(default_factory=dict)


def to_mesh(contents: Contents, source: str, strict: bool = True) -> Mesh:
    """Mesh of a file's contents; `source` is the file's name for messages.

    Raises ValueError if no cell is left; with strict=False a file without cells gives a mesh of points.
    """
    left_out = Counter(contents.left_out)
    blocks = [block for block in contents.blocks if block.cell in CELL_TYPES]
    for block in contents.blocks:
        if block.cell not in CELL_TYPES and len(block.nodes):
            left_out[block.cell] += len(block.nodes)
    left_out_text = ", ".join(f"{name} ({count})" for name, count in sorted(left_out.items()))
    if left_out and blocks:
        warnings.warn(
            f"{source}: elements not understood and left out: {left_out_text}; {sum(len(b.nodes) for b in blocks)} are "
            f"kept. Understood are {sorted(CELL_TYPES)}.",
            PhysicsWarning,
            stacklevel=3,
        )
    points = np.asarray(contents.points, float)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    _check_nodes(blocks, len(points), source)
    cells, cell_groups = _joined_blocks(blocks)
    for group in contents.empty:
        cell_groups.setdefault(group, {})
    mesh = without_vertices(Mesh(points, cells, cell_groups, dict(contents.point_groups)))
    if not mesh.cells and not strict and not left_out:
        return mesh
    if not mesh.cells:
        only_text = f", only {left_out_text}" if left_out_text else ""
        raise ValueError(
            f"{source} holds no elements that are understood{only_text}; understood are {sorted(CELL_TYPES)}."
        )
    return mesh.compacted()


def without_vertices(mesh: Mesh) -> Mesh:
    """The mesh with cells of a single point turned into point groups."""
    cell_groups: dict[str, CellGroup] = {}
    point_groups = dict(mesh.point_groups)
    for group, by_type in mesh.cell_groups.items():
        other_cells = {cell: rows for cell, rows in by_type.items() if cell != "vertex"}
        if "vertex" in by_type:
            points = mesh.cells["vertex"][by_type["vertex"]].ravel()
            point_groups[group] = np.concatenate([point_groups.get(group, points[:0]), points])
        if other_cells or "vertex" not in by_type:
            cell_groups[group] = other_cells
    for group in [g for g in cell_groups if not cell_groups[g] and g in point_groups]:
        del cell_groups[group]
    cells = {cell: rows for cell, rows in mesh.cells.items() if cell != "vertex"}
    return Mesh(mesh.points, cells, cell_groups, point_groups)


def with_renamed_groups(
    mesh: Mesh, requested: Mapping[str, str] | None, titles: Mapping[str, str], source: str
) -> Mesh:
    """The mesh with groups renamed: by `requested` {new name: name in the file}, then by the titles in the file.

    Groups that get the same name are united.
    """
    new_names: dict[str, list[str]] = {}
    keys = {_normalised_name(name): name for name in mesh.groups}
    keys |= {_normalised_name(title): name for name, title in titles.items() if name in mesh.groups}
    for name, file_name in (requested or {}).items():
        if _normalised_name(file_name) not in keys:
            raise ValueError(
                f"{source} has no group {file_name!r} to be named {name!r}; it has {sorted(keys.values())}"
                f"{f' titled {sorted(titles.values())}' if titles else ''}. Correct the mapping of groups."
            )
        new_names.setdefault(keys[_normalised_name(file_name)], []).append(name)
    for name, title in titles.items():
        new_names.setdefault(name, [title])
    cell_groups: dict[str, CellGroup] = {}
    for group, by_type in mesh.cell_groups.items():
        for name in new_names.get(group, [group]):
            rows_by_type = cell_groups.setdefault(name, {})
            for cell, rows in by_type.items():
                rows_by_type[cell] = np.union1d(rows_by_type.get(cell, rows), rows)
    point_groups: dict[str, IntArray] = {}
    for group, rows in mesh.point_groups.items():
        for name in new_names.get(group, [group]):
            point_groups[name] = np.union1d(point_groups.get(name, rows), rows)
    return Mesh(mesh.points, mesh.cells, cell_groups, point_groups)


def _normalised_name(name: str) -> str:
    """One spelling for "SET 4", "set 4" and "set_4"."""
    return "_".join(name.lower().split())


def _joined_blocks(blocks: list[Block]) -> tuple[dict[str, IntArray], dict[str, CellGroup]]:
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


def with_middle_nodes(contents: Contents, source: str) -> Contents:
    """The contents with every middle node that is -1 in a block replaced.

    The replacement is the node of another cell between the same corners, or a new node at their middle. A warning gives
    the number of cells and of new nodes.
    """
    middles = [
        (block, column, parents)
        for block in contents.blocks if block.cell in CELL_TYPES
        for column, parents in enumerate(CELL_TYPES[block.cell].parents, CELL_TYPES[block.cell].n_corners)
    ]  # fmt: skip
    partial = [middle for middle in middles if (middle[0].nodes[:, middle[1]] == -1).any()]
    if not partial:
        return contents
    node_between: dict[frozenset[int], int] = {}
    for block, column, parents in middles:
        for corners, node in zip(block.nodes[:, parents].tolist(), block.nodes[:, column].tolist(), strict=True):
            if node >= 0:
                node_between[frozenset(corners)] = node
    points, first = [np.asarray(contents.points, float)], len(contents.points)
    completed: dict[int, IntArray] = {}
    for block, column, parents in partial:
        nodes = completed.setdefault(id(block), block.nodes.copy())
        for row in np.flatnonzero(block.nodes[:, column] == -1):
            corners = block.nodes[row, parents]
            key = frozenset(corners.tolist())
            if key not in node_between:
                node_between[key] = first + len(points) - 1
                points.append(points[0][corners].mean(axis=0, keepdims=True))
            nodes[row, column] = node_between[key]
    count = sum(int((block.nodes == -1).any(axis=1).sum()) for block in contents.blocks if id(block) in completed)
    warnings.warn(
        f"{source}: {count} cells of second order have some middle nodes only; {len(points) - 1} nodes are added at "
        "the middle of their edges. Beside a neighbour of first order such a node follows the straight edge",
        PhysicsWarning,
        stacklevel=3,
    )
    blocks = [replace(block, nodes=completed.get(id(block), block.nodes)) for block in contents.blocks]
    return replace(contents, points=np.concatenate(points), blocks=blocks)


def group_classes(groups: Mapping[str, IntArray], count: int) -> list[tuple[tuple[str, ...], IntArray]]:
    """Names of the groups and rows of every class; items 0 .. count - 1 of a class belong to exactly the same groups.

    >>> [(names, rows.tolist()) for names, rows in group_classes({"a": np.array([1, 2]), "b": np.array([2])}, 4)]
    [((), [0, 3]), (('a',), [1]), (('a', 'b'), [2])]
    """
    member = np.zeros((count, len(groups)), bool)
    for column, rows in enumerate(groups.values()):
        member[rows, column] = True
    memberships, first, inverse = np.unique(member, axis=0, return_index=True, return_inverse=True)
    names = np.array([*groups, ""], object)[:-1]
    return [(tuple(names[memberships[k]]), np.flatnonzero(inverse.ravel() == k)) for k in np.argsort(first)]


def without_repeated_cells(blocks: list[Block], keys: list[IntArray]) -> list[Block]:
    """One block for every type of cell, in which a cell listed several times is one cell in several groups.

    keys: of every block the rows (n, k) that are equal for one and the same cell
    """
    distinct = []
    for cell in dict.fromkeys(block.cell for block in blocks):
        alike = [(block, key) for block, key in zip(blocks, keys, strict=True) if block.cell == cell]
        key_rows = np.concatenate([key for _, key in alike])
        _, first, inverse = np.unique(key_rows, axis=0, return_index=True, return_inverse=True)
        row = np.argsort(np.argsort(first))[inverse.ravel()]  # unique sorts; keep the file's order
        start, groups = 0, dict[str, list[IntArray]]()
        for block, _ in alike:
            for name, members in block.groups.items():
                groups.setdefault(name, []).append(row[start + members])
            start += len(block.nodes)
        nodes = np.concatenate([block.nodes for block, _ in alike])[np.sort(first)]
        distinct.append(Block(cell, nodes, {name: np.unique(np.concatenate(rows)) for name, rows in groups.items()}))
    return distinct
