"""MatrixModel -> FlexibleBody: the checks, the structure, a set of shapes, and notes on the effects that matrices
cannot represent."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg, sparse

from femflex.arrays import Array
from femflex.body import FlexibleBody, Foreshortening, MassMoments
from femflex.fem.matrix_structure import MatrixStructure
from femflex.matrices.checks import GROUNDED, StatedMass, check_model, relative_energy
from femflex.matrices.model import MatrixModel
from femflex.matrices.read import symmetric
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.matrices import MatrixBody, reduce_matrices
from femflex.reduction.modes.damping import Damping
from femflex.reduction.modes.vibration import ModeSet, cantilever_modes
from femflex.warning import PhysicsWarning

Reduce = Callable[[MatrixStructure], ModeSet]

SPINNING = (
    "its strain is linear, with a geometric stiffness that grows with the square of its rate about the given axis; "
    "other loads do not stiffen or soften it"
)
DENSE = 3000  # dofs up to which the rounding of a file is removed from the stiffness of the rigid motions
MASSLESS = 1e-13  # eigenvalue of the scaled mass matrix below which a motion has no mass
STATIONS = 60  # along the longest extent at most, over which the shape is averaged before its slope is taken


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


def estimated_foreshortening(body: FlexibleBody) -> Foreshortening | None:
    """Foreshortening of the lowest shape of a body, treated as a line along its longest extent; None if it has no skin.

    w(s) is the mean displacement [m] of the shape across the line e. theta(s) = -e int_0^s w'^2 ds divided by the
    shape's stiffness, with s from the origin of the body, where it is clamped. All points of the skin have equal mass.
    """
    n, skin = body.n_modes, body.skin
    if not n or skin is None or len(skin.points) < 2:
        return None
    V1, Me = (body.strain.V1 + body.strain.V1.T) / 2, body.moments.elastic_mass()[:n, :n]
    value, vectors = linalg.eigh(V1, Me, subset_by_index=[0, 0])
    if not value[0] > 0:
        return None
    x = np.asarray(skin.points, float)
    u = np.einsum("n,npa->pa", vectors[:, 0], np.asarray(skin.shapes)[:n])
    e = np.linalg.svd(x - x.mean(axis=0), full_matrices=False)[2][0]
    s = x @ e
    if not np.ptp(s) > 0:
        return None
    position = np.round((s - s.min()) / np.ptp(s) * STATIONS, 6)  # points of one section stay together
    station = np.unique(np.round(position).astype(int), return_inverse=True)[1]
    count = np.bincount(station)
    station_s = np.bincount(station, s) / count
    across = np.stack([np.bincount(station, u[:, a]) / count for a in range(3)], axis=1)
    across = across - np.outer(across @ e, e)
    # int w'^2 ds between stations
    slope_squared = np.linalg.norm(np.diff(across, axis=0), axis=1) ** 2 / np.diff(station_s)
    shortening = np.concatenate([[0.0], np.cumsum(slope_squared)]) / value[0]

    def theta(points: Array) -> Array:
        """theta (k, 3) [1/N] at points (k,) [m] along the line."""
        return np.asarray(
            -np.outer(np.interp(points, station_s, shortening) - np.interp(0.0, station_s, shortening), e)
        )

    share = body.moments.mass / len(x)
    z = np.column_stack([np.ones(len(x)), x])
    markers = {name: theta(np.array([marker.position @ e]))[0] for name, marker in body.markers.items()}
    return Foreshortening(share * z.T @ theta(s), markers)


# Geometric stiffness that grows with the square of a body's rate about an axis.
#
# An additional shape has the dependent amplitude y = 1/2 delta.G delta. Its only mass moments are P[s, a, 0, b] =
# B_ab = e_a e_b - 1/2 delta_ab. In a rotating frame its inertia force is B : W = (omega.e)^2, W = omega omega^T -
# |omega|^2 1 (THEORY section 3), which gives the coordinates the stiffness (omega.e)^2 G. B is symmetric, so that
# accelerations of the frame have no effect.


def with_spin_stiffness(body: FlexibleBody, G: Array, axis: ArrayLike) -> FlexibleBody:
    """The body with the stiffness (omega.e)^2 G of its n coordinates, G (n, n) [1/s^2 per (rad/s)^2], e the unit axis.

    Raises ValueError when the axis is zero.
    """
    e = np.asarray(axis, float)
    if not np.linalg.norm(e) > 0:
        raise ValueError(f"the axis of the spin is {e.tolist()}; give a direction")
    e = e / np.linalg.norm(e)
    n, moments = body.n_shapes, body.moments
    first, second = np.zeros((2 + n, 3)), np.zeros((2 + n, 3, 2 + n, 3))
    first[:-1], second[:-1, :, :-1] = moments.first, moments.second
    second[0, :, -1] = second[-1, :, 0] = np.outer(e, e) - np.eye(3) / 2
    no_motion = np.zeros((3, 1))
    skin = body.skin
    if skin is not None:
        skin = replace(skin, shapes=np.concatenate([skin.shapes, np.zeros((1, *skin.points.shape))]))
    return replace(
        body,
        moments=MassMoments(moments.mass, first, second),
        markers={
            name: replace(m, phi=np.column_stack([m.phi, no_motion]), psi=np.column_stack([m.psi, no_motion]))
            for name, m in body.markers.items()
        },
        skin=skin,
        kinds=(*body.kinds, "remainder"),
        omega=np.append(body.omega, np.nan),
        slaves=np.concatenate([body.slaves.reshape(-1, body.n_modes, body.n_modes), (G + G.T)[None] / 2]),
    )
