"""MatrixModel -> FlexibleBody: the checks, the structure, a set of shapes, and notes on the effects that matrices
cannot represent."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg, sparse

from femflex.fem.matrix_structure import MatrixStructure
from femflex.matrices.checks import GROUNDED, StatedMass, check_model, relative_energy
from femflex.matrices.foreshortening import estimated_foreshortening
from femflex.matrices.model import MatrixModel
from femflex.matrices.read import symmetric
from femflex.matrices.spin import with_spin_stiffness
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.matrices import MatrixBody, reduce_matrices
from femflex.reduction.modes.damping import Damping
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.vibration import cantilever_modes
from femflex.warning import PhysicsWarning

Reduce = Callable[[MatrixStructure], ModeSet]

SPINNING = (
    "its strain is linear, with a geometric stiffness that grows with the square of its rate about the given axis; "
    "other loads do not stiffen or soften it"
)
DENSE = 3000  # dofs up to which the rounding of a file is removed from the stiffness of the rigid motions
MASSLESS = 1e-13  # eigenvalue of the scaled mass matrix below which a motion has no mass


def matrix_body(
    model: MatrixModel,
    reduce: Reduce | None = None,
    groups: Sequence[str] = (),
    markers: Mapping[str, str] | None = None,
    damping: Damping | None = None,
    turning: Container[str] | None = None,
    stated: StatedMass | None = None,
) -> MatrixBody:
    """The FlexibleBody of a model, with linear strain, and notes on the effects that its matrices do not contain.

    reduce   function that computes its set of shapes, such as lambda s: cantilever_modes(s, "root", 8); None: all
             modes of a reduced model, with the first node as reference (`all_modes`)
    groups   groups that `reduce` names: those of the model, or node_17
    markers  name -> group; damping: replaces the damping matrix of the model
    stated   mass properties with which the model is compared

    A body without a geometric stiffness gets an estimate of its foreshortening. Runs use it to warn of the stiffness
    that spin, thrust and weight would add.

    Raises ValueError with all errors of its checks (`check_model`); warns of the other findings.
    """
    report = check_model(model, stated)
    if report.errors:
        raise ValueError(f"{model.name} cannot be used: " + "; ".join(report.errors))
    for text in report.warnings:
        warnings.warn(f"{model.name}: {text}", PhysicsWarning, stacklevel=2)
    markers = dict(markers or {})
    structure = symmetric(model).structure([*groups, *markers.values()])
    if reduce is None:
        if not model.reduced:
            raise ValueError(f"{model.name} has no modal coordinates; give it a reduction, such as cantilever modes")
        reference = f"node_{model.loaded[0]}"
        structure = symmetric(model).structure([*groups, *markers.values(), reference])
        modes = all_modes(structure, reference)
    else:
        modes = reduce(structure)
    reduced = reduce_matrices(structure, modes, markers, damping, turning, model.distribution)
    if model.geometric is None:
        return replace(reduced, body=replace(reduced.body, foreshortening=estimated_foreshortening(reduced.body)))
    if model.spin_axis is None or not reduced.body.n_modes:
        return reduced
    assert model.geometric is not None
    G = modes.phi.T @ (model.geometric @ modes.phi)
    return MatrixBody(with_spin_stiffness(reduced.body, G, model.spin_axis), (SPINNING, *reduced.notes[1:]))


def all_modes(structure: MatrixStructure, reference: str) -> ModeSet:
    """All modes of the matrices with the reference group fixed in the body frame; for reduced models."""
    free = np.setdiff1d(np.arange(structure.n_dof), structure.clamped_dofs(reference))
    M = structure.M[free][:, free].toarray()
    d = np.sqrt(np.where(np.diag(M) > 0, np.diag(M), 1.0))
    n = int((linalg.eigvalsh(M / d / d[:, None]) > MASSLESS).sum())
    return cantilever_modes(structure, reference, n)


def without_rounding(structure: MatrixStructure) -> MatrixStructure:
    """The structure with K R = 0 exactly for its rigid motions R, which the file's digits satisfy only approximately.

    K becomes P^T K P with P = 1 - R (R^T W R)^-1 R^T W, W the diagonal of K. The structure is
    returned unchanged if K R is larger than rounding, or if the matrices are large.
    """
    R = rigid_shapes(structure)
    if structure.n_dof > DENSE or (relative_energy(structure.K, R) > GROUNDED).any():
        return structure
    W = np.maximum(structure.K.diagonal(), 1e-12 * structure.K.diagonal().max())
    X = linalg.solve(R.T @ (W[:, None] * R), (W[:, None] * R).T, assume_a="sym")
    P = np.eye(structure.n_dof) - R @ X
    K = P.T @ structure.K.toarray() @ P
    K = sparse.csr_array((K + K.T) / 2)
    return replace(structure, K0=K)
