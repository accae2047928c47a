"""Solids whose nodes are numbered inside out, all of a type alike: turned to the right order with a warning."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.mesh import Mesh
from femflex.mesh.quality import sizes
from femflex.warning import PhysicsWarning


def upright(mesh: Mesh, source: str = "the mesh") -> Mesh:
    """The mesh with cells of those solid types mirrored whose volumes are all negative; warns where there are such.

    Types of which some cells alone are inside out stay as they are.
    """
    cells = dict(mesh.cells)
    for name, nodes in mesh.cells.items():
        cell = CELL_TYPES[name]
        if cell.dimension == 3 and np.all(sizes(mesh.points, name, nodes) < 0):
            cells[name] = nodes[:, cell.mirrored]
            warnings.warn(
                f"{source}: all {len(nodes)} cells of type {name} are inside out (their volumes are negative); their "
                "nodes are taken in the mirrored order. Correct the order of nodes in the file",
                PhysicsWarning,
                stacklevel=3,
            )
    return replace(mesh, cells=cells)
