"""Solids whose nodes are numbered inside out: reordered with a warning."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh
from femflex.mesh.quality import qualities
from femflex.warning import PhysicsWarning


def reorient_solids(mesh: Mesh, source: str = "the mesh") -> Mesh:
    """The mesh with inside-out solid cells mirrored if that makes them regular; warns if there are any.

    Cells that are folded in both orders do not change.
    """
    cells = dict(mesh.cells)
    for name, nodes in mesh.cells.items():
        cell = CELL_TYPES[name]
        if cell.dimension != 3:
            continue
        mirrored = nodes[:, cell.mirrored]
        inverted = qualities(mesh.points, name, nodes) < 0
        inverted[inverted] = qualities(mesh.points, name, mirrored[inverted]) > 0
        if inverted.any():
            cells[name] = np.where(inverted[:, None], mirrored, nodes)
            count, first_text = f"all {len(nodes)}", ""
            if not inverted.all():
                first = int(np.argmax(inverted))
                x, y, z = mesh.points[nodes[first]].mean(axis=0)
                count = f"{int(inverted.sum())} of {len(nodes)}"
                first_text = f", the first is number {first} at ({x:.6g}, {y:.6g}, {z:.6g}) m"
            warnings.warn(
                f"{source}: {count} cells of type {name} are inside out (their volumes are negative){first_text}; "
                "their nodes are taken in the mirrored order. Correct the order of nodes in the file",
                PhysicsWarning,
                stacklevel=3,
            )
    return replace(mesh, cells=cells)
