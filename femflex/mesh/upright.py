"""Solids whose nodes are numbered inside out: turned to the right order with a warning."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh
from femflex.mesh.quality import qualities
from femflex.warning import PhysicsWarning


def upright(mesh: Mesh, source: str = "the mesh") -> Mesh:
    """The mesh with those solid cells mirrored that are regular so, and inside out as they are; warns where any are.

    Cells that are folded either way stay as they are.
    """
    cells = dict(mesh.cells)
    for name, nodes in mesh.cells.items():
        cell = CELL_TYPES[name]
        if cell.dimension != 3:
            continue
        mirrored = nodes[:, cell.mirrored]
        turned = qualities(mesh.points, name, nodes) < 0
        turned[turned] = qualities(mesh.points, name, mirrored[turned]) > 0
        if turned.any():
            cells[name] = np.where(turned[:, None], mirrored, nodes)
            count, place = f"all {len(nodes)}", ""
            if not turned.all():
                first = int(np.argmax(turned))
                x, y, z = mesh.points[nodes[first]].mean(axis=0)
                count = f"{int(turned.sum())} of {len(nodes)}"
                place = f", the first is number {first} at ({x:.6g}, {y:.6g}, {z:.6g}) m"
            warnings.warn(
                f"{source}: {count} cells of type {name} are inside out (their volumes are negative){place}; "
                "their nodes are taken in the mirrored order. Correct the order of nodes in the file",
                PhysicsWarning,
                stacklevel=3,
            )
    return replace(mesh, cells=cells)
