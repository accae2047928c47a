"""Bodies from given matrices: a Structure without elements and a set of shapes -> FlexibleBody with linear strain."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, StrainTensors
from femflex.fem.matrix_structure import MatrixStructure
from femflex.reduction.boundary.markers import marker, marker_rows
from femflex.reduction.boundary.rigid import check_no_rigid_motion, rigid_shapes
from femflex.reduction.inertia.mass_matrix import Distribution, matrix_moments
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
