"""Structure -> MatrixModel: the full mass and stiffness of a finite element model, with nodes and groups."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from femflex.fem.matrix_structure import DRAWN
from femflex.fem.structure import Structure
from femflex.matrices.model import MatrixModel

UNIT = 1e-12  # difference from 1 of the entry of a dof that is one component of one node


def full_model(structure: Structure, name: str = "structure") -> MatrixModel:
    """The matrices of a Structure, nodes numbered from 1 in the order of its mesh.

    Dofs that belong to no node (bubbles, sides of plates) are scalar coordinates. Raises ValueError if a dof is not a
    component of one node in global axes (skew supports, connections, facets of plates askew to the axes).
    """
    n = len(structure.mesh.points)
    rows = sparse.vstack([structure.translation, structure.rotation]).tocoo()
    row, column = rows.coords
    dofs = np.stack([1000 + n + np.arange(structure.n_dof), np.zeros(structure.n_dof, np.int64)], axis=1)
    shared = np.bincount(column, minlength=structure.n_dof) > 1
    if shared.any() or np.abs(rows.data - 1.0).max(initial=0.0) > UNIT:
        raise ValueError(
            f"{int(shared.sum())} degrees of freedom of the structure are no single components of nodes (skew "
            "supports, connections, plates askew to the axes); reduce it and write a Craig-Bampton model instead"
        )
    dofs[column, 0] = (row % (3 * n)) // 3 + 1
    dofs[column, 1] = row % 3 + 1 + 3 * (row >= 3 * n)
    mesh = structure.mesh
    return MatrixModel(
        name=name,
        ids=np.arange(1, n + 1),
        points=mesh.points,
        dofs=dofs.astype(np.int64),
        M=structure.M,
        K=structure.K,
        groups={group: mesh.group_points(group) + 1 for group in mesh.groups},
        cells={kind: cells + 1 for kind, cells in mesh.cells.items() if kind in DRAWN},
    )
