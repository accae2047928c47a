"""Middle nodes of second-order members at groups that have only the corners of their faces and edges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import IntArray
from femflex.fem.family import EDGES as FAMILY_EDGES
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES
from femflex.mesh.second_order import raise_order, rows_between

if TYPE_CHECKING:
    from femflex.fem.structure import Member


def led_by_middles(family: str, kind: str) -> bool:
    """Return whether nodes in the middle of the edges move cells of this type in a member of this family."""
    return FAMILY_EDGES.get(family) == "interpolated" and CELL_TYPES[kind].order == 2


def with_raised_boundaries(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh with lines and surfaces of no member raised to the order of the members' faces and edges that
    they lie on, and a note about it.

    A group of four-node faces of 20-node hexahedra so has all eight nodes of each, for supports, markers and loads.
    """
    used: dict[str, list[IntArray]] = {}
    for member in members:
        for kind, rows in mesh.cell_groups.get(member.group, {}).items():
            used.setdefault(kind, []).append(rows)
    raised = rows_between(mesh, _second_order_cells(mesh, members), {k: np.concatenate(r) for k, r in used.items()})
    groups = [
        group
        for group, by_type in mesh.cell_groups.items()
        if any(np.isin(rows, raised.get(kind, [])).any() for kind, rows in by_type.items())
    ]
    if not raised:
        return mesh, ()
    new_mesh, _ = with_raised_boundaries(raise_order(mesh, raised), members)  # eight-node faces may have a centre, too
    if not groups:
        return new_mesh, ()
    before, after = (
        np.unique(np.concatenate([nodes.ravel() for group in groups for nodes in m.group_cells(group).values()]))
        for m in (mesh, new_mesh)
    )
    return new_mesh, (
        f"cells of first order of {', '.join(map(repr, groups))} take the {len(after) - len(before)} middle nodes of "
        "the second-order faces and edges that they lie on",
    )


def middles_left_out(mesh: Mesh, members: Sequence[Member], nodes: IntArray) -> IntArray:
    """Return the middle nodes (k,), ascending, of faces of second-order solids, and of edges of second-order surfaces,
    that have all their corners among nodes (n,) and no middle node."""
    inside = np.zeros(len(mesh.points), bool)
    inside[nodes] = True
    left_out = [np.zeros(0, np.int64)]
    for kind, every in _second_order_cells(mesh, members).items():
        cell = CELL_TYPES[kind]
        cells = every[inside[every[:, : cell.n_corners]].sum(axis=1) > 1]
        parents = [set(corners.tolist()) for corners in cell.parents]
        for part in FACES[cell.shape] if cell.dimension == 3 else EDGES[cell.shape]:
            between = [k for k, corners in enumerate(parents, cell.n_corners) if corners <= set(part)]
            others = between if cell.dimension == 3 else [*range(cell.n_corners, cells.shape[1])]
            corners_alone = inside[cells[:, part]].all(axis=1) & ~inside[cells[:, others]].any(axis=1)
            left_out.append(cells[corners_alone][:, between].ravel())
    return np.unique(np.concatenate(left_out))


def _second_order_cells(mesh: Mesh, members: Sequence[Member]) -> dict[str, IntArray]:
    """Nodes (e, k), by cell type, of the cells that are moved by middle nodes."""
    rows: dict[str, list[IntArray]] = {}
    for member in members:
        for kind, numbers in mesh.cell_groups.get(member.group, {}).items():
            if led_by_middles(member.family, kind):
                rows.setdefault(kind, []).append(numbers)
    return {kind: mesh.cells[kind][np.unique(np.concatenate(numbers))] for kind, numbers in rows.items()}
