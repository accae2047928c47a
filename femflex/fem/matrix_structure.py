"""A Structure with prescribed mass and stiffness matrices: it has no elements and so no inertia table and no strain
table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import SkinPart
from femflex.fem.structure import Structure
from femflex.mesh import Mesh

SCALAR = -1  # point number of a dof that belongs to no point: a modal coordinate


@dataclass(frozen=True, eq=False)
class MatrixStructure(Structure):
    """A Structure whose matrices come from elsewhere.

    D        (n_dof, n_dof)  damping, or None
    places_of_dofs (n_dof, 2)  point (SCALAR: none) and component 0..5 (x, y, z, rx, ry, rz) of every dof
    """

    D: sparse.csr_array | None = None
    places_of_dofs: IntArray | None = None

    @property
    def scalars(self) -> IntArray:
        """Numbers (k,) of dofs that belong to no point."""
        assert self.places_of_dofs is not None
        return np.flatnonzero(self.places_of_dofs[:, 0] == SCALAR).astype(np.int64)


def structure_from_matrices(
    mesh: Mesh,
    dofs: IntArray,
    M: sparse.csr_array,
    K: sparse.csr_array,
    D: sparse.csr_array | None = None,
    frames: Array | None = None,
    recovery: tuple[Array, sparse.csr_array] | None = None,
) -> MatrixStructure:
    """Return the Structure of matrices M, K (n_dof, n_dof) and damping D on the points of a mesh.

    dofs      (n_dof, 2)    point of the mesh and component 0..5 of every row; point SCALAR for a modal coordinate
    frames    (n_p, 3, 3)   rows are the axes of each point along which its components count; None: the mesh's axes
    recovery  additional positions (p, 3) to draw, and their displacement (3 p, n_dof)

    The mesh gives names of groups, and cells to draw. Raises ValueError when sizes do not fit or a dof is repeated.
    """
    n = len(dofs)
    for name, matrix in (("M", M), ("K", K), ("D", D)):
        if matrix is not None and matrix.shape != (n, n):
            raise ValueError(
                f"{name} is {matrix.shape[0]} x {matrix.shape[1]}, and the map of degrees of freedom has {n} rows; "
                "give matrices and map of one size"
            )
    check_distinct(dofs)
    numbering = Numbering(len(mesh.points))
    moves, turns = ((dofs[:, 0] >= 0) & low for low in (dofs[:, 1] < 3, dofs[:, 1] >= 3))
    for number, mask in ((numbering.translation, moves), (numbering.rotation, turns)):
        if mask.any():
            number(np.unique(dofs[mask, 0]))
    scalars = np.flatnonzero(dofs[:, 0] == SCALAR)
    extra = numbering.extra(len(scalars))
    T = _raw_from_dofs(numbering, dofs, (moves, turns), (scalars, extra), frames)
    translation, rotation = (rows @ T for rows in numbering.node_rows(T.shape[0]))
    return MatrixStructure(
        mesh=mesh,
        M=sparse.csr_array(M),
        K0=sparse.csr_array(K),
        T=T,
        inertia=(),
        strain=(),
        translation=sparse.csr_array(translation),
        rotation=sparse.csr_array(rotation),
        skin_parts=tuple(_skin_parts(mesh, numbering, T, recovery)),
        numbering=numbering,
        places=(),
        D=None if D is None else sparse.csr_array(D),
        places_of_dofs=np.asarray(dofs, np.int64),
    )


def check_distinct(dofs: IntArray) -> None:
    """Raise ValueError when two rows of the map (n_dof, 2), point and component, name the same component of a point."""
    physical = dofs[dofs[:, 0] >= 0]
    _, first, count = np.unique(physical, axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        point, component = physical[first[count > 1][0]]
        raise ValueError(
            f"the map of degrees of freedom names component {component + 1} of point {point} {count.max()} times; "
            "each row and column of the matrices needs a component of its own"
        )


def _raw_from_dofs(
    numbering: Numbering,
    dofs: IntArray,
    kinds: tuple[BoolArray, BoolArray],
    scalars: tuple[IntArray, IntArray],
    frames: Array | None,
) -> sparse.csr_array:
    """T (n_raw, n_dof): global components of the points from their own components."""
    rows, columns, values = [scalars[1]], [scalars[0]], [np.ones(len(scalars[0]))]
    for mask, table, first in ((kinds[0], numbering.translation_of, 0), (kinds[1], numbering.rotation_of, 3)):
        dof_rows = np.flatnonzero(mask)
        points, component = dofs[dof_rows, 0], dofs[dof_rows, 1] - first
        axes = np.broadcast_to(np.eye(3), (len(dof_rows), 3, 3)) if frames is None else frames[points]
        rows.append(table(points).ravel())
        columns.append(np.repeat(dof_rows, 3))
        values.append(axes[np.arange(len(dof_rows)), component].ravel())
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    T = sparse.coo_array(triplets, shape=(numbering.n_raw, len(dofs))).tocsr()
    T.eliminate_zeros()
    return T


def _skin_parts(
    mesh: Mesh, numbering: Numbering, T: sparse.csr_array, recovery: tuple[Array, sparse.csr_array] | None
) -> list[Callable[[], SkinPart]]:
    """Return the drawn parts: cells of the mesh, or its points, and recovered positions."""

    def of_mesh() -> SkinPart:
        raw = numbering.translation_of(np.arange(len(mesh.points)))
        points, axes = np.nonzero(raw >= 0)
        cells = {kind: rows for kind, rows in mesh.cells.items() if kind in DRAWN}
        cells = cells or {"vertex": np.arange(len(mesh.points))[:, None]}
        return SkinPart(mesh.points, cells, 3 * points + axes, raw[points, axes], np.ones(len(points)))

    def recovered() -> SkinPart:
        assert recovery is not None
        points, rows = recovery
        raw = (rows @ T.T).tocoo()  # the columns of T are orthonormal
        vertices = {"vertex": np.arange(len(points))[:, None]}
        return SkinPart(points, vertices, raw.coords[0].astype(np.int64), raw.coords[1].astype(np.int64), raw.data)

    return [of_mesh, recovered] if recovery is not None else [of_mesh]


DRAWN = ("vertex", "line", "triangle", "quad")
