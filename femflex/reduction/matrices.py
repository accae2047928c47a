"""Bodies from given matrices: a Structure without elements and a set of shapes -> FlexibleBody with linear strain."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody, StrainTensors
from femflex.fem.matrix_structure import MatrixStructure, structure_from_matrices
from femflex.mesh import Mesh
from femflex.reduction.boundary.markers import marker, marker_rows
from femflex.reduction.boundary.rigid import check_no_rigid_motion, rigid_shapes
from femflex.reduction.inertia.mass_matrix import Distribution, matrix_moments, nodal_mass
from femflex.reduction.inertia.moments import linear_stiffness
from femflex.reduction.limits import LUMPED_MASS_ERROR
from femflex.reduction.modes.damping import Damping, is_added, is_unanswered
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.reduce import dof_weight, skin_of
from femflex.warning import warn_of_physics


@dataclass(frozen=True, eq=False)
class MatrixBody:
    """A body made from matrices, and sentences on what the matrices leave open."""

    body: FlexibleBody
    notes: tuple[str, ...]


def reduce_matrices(
    structure: MatrixStructure,
    modes: ModeSet,
    markers: Mapping[str, str] | None = None,
    damping: Damping | None = None,
    turning: Container[str] | None = None,
    distribution: Distribution | None = None,
) -> MatrixBody:
    """The FlexibleBody of given matrices that moves in these shapes, with linear strain.

    markers: name -> group of the structure's mesh; the set's own groups are markers too.
    damping: in place of the structure's own matrix D. Left out: phi^T D phi, or none.
    distribution: where the mass is, of models whose dofs are not those of all nodes (`matrix_moments`).

    Warns where the inertia that depends on the deformation is not that of the matrix. Raises ValueError when a group is
    unknown, or the shapes depend on each other or contain a rigid motion.
    """
    phi = modes.phi
    check_no_rigid_motion(rigid_shapes(structure), phi, dof_weight(structure))
    found = matrix_moments(structure, phi, distribution)
    V1 = linear_stiffness(structure.K, phi)
    places = {**{group: group for group in modes.groups}, **(markers or {})}
    body = FlexibleBody(
        moments=found.moments,
        strain=StrainTensors.linear(V1),
        damping=_damping(structure, modes, damping, found.moments.elastic_mass(), V1),
        markers={
            name: marker(marker_rows(structure, group), phi, name, turning is None or name in turning)
            for name, group in places.items()
        },
        skin=skin_of(structure, phi),
        kinds=modes.kinds,
        omega=modes.omega,
    )
    if not phi.shape[1]:
        return MatrixBody(body, ())
    if not found.exact and not found.missed <= LUMPED_MASS_ERROR:
        warn_of_physics(_missed_text(found.missed))
    return MatrixBody(body, (LINEAR, _exactness_text(found.exact, found.missed)))


LINEAR = (
    "matrices give linear strain alone: no geometric stiffness of spin, thrust or tension, and no foreshortening; "
    "where a load stiffens or softens the body, give its geometric stiffness, or make the body of elements"
)


def _exactness_text(exact: bool, missed: float) -> str:
    if exact:
        return "its mass moments are exact: those of the mass matrix, or written with the model"
    if np.isnan(missed):
        return "its mass moments are exact at rest; those that change with the deformation are approximate"
    return (
        "its mass moments are exact at rest and in its elastic mass; second moments of the deformation are those of "
        f"the lumped mass, which misses at most {100 * missed:.2g} % of a shape's elastic mass and is rescaled to it"
    )


def _missed_text(missed: float) -> str:
    if np.isnan(missed):
        return (
            "the distribution of mass of the reduced model between its interfaces is unknown: its inertia at rest "
            "and its elastic mass are exact, and the inertia's change with the deformation (spin softening, gyroscopic "
            "coupling of modes) is zero or equal along three axes; give recovery rows with nodal masses, or the "
            "moments that femflex writes"
        )
    return (
        f"lumped at its nodes, the mass matrix misses {100 * missed:.2g} % of the elastic mass of a shape (limit "
        f"{100 * LUMPED_MASS_ERROR:g} %): second moments of the deformation (spin softening, gyroscopic coupling of "
        "modes) have errors of that size, and are rescaled; give a mesh with more nodes per wavelength, or a lumped "
        "mass matrix"
    )


def _damping(structure: MatrixStructure, modes: ModeSet, damping: Damping | None, Me: Array, V1: Array) -> Array:
    if damping is None and structure.D is not None:
        D = modes.phi.T @ (structure.D @ modes.phi)
        return np.asarray((D + D.T) / 2)
    return (damping or Damping(ratio=0.0)).matrix(Me, V1, is_added(modes.kinds), is_unanswered(modes.kinds))


def body_from_matrices(
    X: Array,
    M: sparse.csr_array,
    K: sparse.csr_array,
    phi: Array,
    markers: Mapping[str, IntArray] | None = None,
    damping: Damping | None = None,
    cells: Mapping[str, IntArray] | None = None,
    omega: Array | None = None,
    kinds: tuple[str, ...] | None = None,
) -> FlexibleBody:
    """The FlexibleBody of nodes X (n, 3) with matrices M, K (3n, 3n), dof 3 * node + axis, and shapes phi (3n, k).

    markers: name -> nodes (mean displacement and least-squares rotation). cells: what is drawn, over X.
    `reduce_matrices` with shapes of your own; raises ValueError on shapes of arrays that do not fit.
    """
    X, n = np.asarray(X, float), 3 * len(X)
    for name, matrix in (("M", M), ("K", K)):
        if matrix.shape != (n, n):
            raise ValueError(
                f"{name} is {matrix.shape[0]} x {matrix.shape[1]}, but {len(X)} nodes with three translations need "
                f"{n} x {n}."
            )
    if phi.ndim != 2 or phi.shape[0] != n:
        raise ValueError(f"phi has shape {phi.shape}; shapes over {len(X)} nodes have {n} rows, one column each.")
    dofs = np.stack(np.divmod(np.arange(n), 3), axis=1)
    groups = {name: np.unique(np.asarray(nodes, np.int64)) for name, nodes in (markers or {}).items()}
    mesh = Mesh(X, dict(cells or {}), point_groups=groups)
    structure = structure_from_matrices(mesh, dofs, sparse.csr_array(M), sparse.csr_array(K))
    if not nodal_mass(structure).exact:
        raise ValueError(
            "the mass matrix is not alike along the three axes, or couples them; give a mass matrix of translations, "
            "dofs ordered 3 * node + axis, or use reduce_matrices, which lumps other ones."
        )
    k = phi.shape[1]
    modes = ModeSet(
        phi,
        kinds or ("vibration" if omega is not None else "nodal",) * k,
        np.full(k, np.nan) if omega is None else np.asarray(omega, float),
    )
    return reduce_matrices(structure, modes, {name: name for name in groups}, damping).body
