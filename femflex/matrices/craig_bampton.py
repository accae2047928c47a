"""FlexibleBody -> Craig-Bampton (Hurty, Benfield) model: interface dofs and fixed-interface modes, free of supports.

The coordinates of a body are p = (translation, rotation, delta): the motion of the body frame, and the deformation in
it. B p are the displacements and rotations of the interfaces, and p = X (u_b, q). A column of u_b is the motion of
least strain energy under a unit displacement of an interface, B p = u_b. A column of q is a mode with B p = 0 and unit
mass.

W. C. Hurty, AIAA Journal 3 (1965) 678; R. R. Craig and M. C. C. Bampton, AIAA Journal 6 (1968) 1313.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg, sparse

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker, MassMoments
from femflex.matrices.model import MatrixModel, Recovery
from femflex.reduction.inertia.mass_matrix import SKEW, KnownMoments

RANK = 1e-8  # singular value of interface motions, relative, below which the body's coordinates do not represent them


def craig_bampton_model(body: FlexibleBody, interfaces: Sequence[str], name: str = "body") -> MatrixModel:
    """The Craig-Bampton model of a body with these markers as interfaces, six dofs each, in SI and global axes.

    Nodes 1, 2, ... are the interfaces, with groups of the same names; modal coordinates follow the interface dofs. The
    model includes the mass moments and the displacement of the body's drawn points, so that reading it back gives the
    same body. A condensed body is linearised in its coordinates.

    Raises ValueError for unknown markers, and if the body's coordinates do not represent all interface motions.
    """
    body = body.without_slaves()
    if not interfaces:
        raise ValueError(f"a Craig-Bampton model needs an interface; name markers of {sorted(body.markers)}")
    repeated = len(set(interfaces)) < len(interfaces)
    unknown = [interface for interface in interfaces if interface not in body.markers]
    if unknown or repeated:
        raise ValueError(
            f"interfaces are {list(interfaces)}; name different ones of the markers {sorted(body.markers)}"
        )
    markers = [body.markers[interface] for interface in interfaces]
    B = np.concatenate([_motion(marker) for marker in markers])
    K, D = (linalg.block_diag(np.zeros((6, 6)), A) for A in (body.strain.V1, body.damping))
    moments = _with_rigid(body.moments)
    M = np.einsum("kala->kl", moments.second[1:, :, 1:])
    X = _basis(B, M, K, interfaces)
    n_b = 6 * len(markers)
    ids = np.arange(1, len(markers) + 1)
    dofs = np.stack([np.repeat(ids, 6), np.tile(np.arange(1, 7), len(ids))], axis=1)
    modal = np.stack([1000 + np.arange(1, X.shape[1] - n_b + 1), np.zeros(X.shape[1] - n_b)], axis=1)

    def on_dofs(A: Array) -> sparse.csr_array:
        return sparse.csr_array(_clean(X.T @ A @ X))

    return MatrixModel(
        name=name,
        ids=ids,
        points=np.array([marker.position for marker in markers]),
        dofs=np.concatenate([dofs, modal]).astype(np.int64),
        M=on_dofs(M),
        K=on_dofs(K),
        D=on_dofs(D) if D.any() else None,
        recovery=_recovery(body, X),
        moments=KnownMoments(moments).moments(X),
        groups={interface: np.array([k]) for interface, k in zip(interfaces, ids, strict=True)},
    )


def _motion(marker: Marker) -> Array:
    """Translation and rotation (6, 6 + n) of a marker per unit of p."""
    n = marker.phi.shape[1]
    across = np.cross(np.eye(3), marker.position).T  # e_c x position in column c
    return np.block([[np.eye(3), across, marker.phi], [np.zeros((3, 3)), np.eye(3), marker.psi.reshape(3, n)]])


def _with_rigid(moments: MassMoments) -> MassMoments:
    """Mass moments over (rho, three translations, three rotations about the origin, the shapes)."""
    n = moments.n_modes
    first, second = np.zeros((7 + n, 3)), np.zeros((7 + n, 3, 7 + n, 3))
    old_rows = np.r_[0, 7 : 7 + n]
    first[old_rows], first[1:4] = moments.first, moments.mass * np.eye(3)
    second[np.ix_(old_rows, range(3), old_rows, range(3))] = moments.second
    for c in range(3):
        second[1 + c, c, old_rows] = moments.first
        second[old_rows, :, 1 + c, c] = moments.first
        for d in range(3):
            second[1 + c, c, 1 + d, d] = moments.mass
    rotation = np.einsum("acd->cad", SKEW)  # (e_c x r)_a = eps_acd r_d
    first[4:7] = np.einsum("cad,d->ca", rotation, first[0])
    for c in range(3):
        rows = np.einsum("ad,dBb->aBb", rotation[c], second[0])
        second[4 + c] = rows
    for c in range(3):
        second[:, :, 4 + c] = np.einsum("ad,Bbd->Bba", rotation[c], second[:, :, 0])
    return MassMoments(moments.mass, first, second)


def _basis(B: Array, M: Array, K: Array, interfaces: Sequence[str]) -> Array:
    """The transformation X (6 + n, n_b + n_q) from interface displacements and modal coordinates to p."""
    size = np.linalg.norm(B, axis=1)
    _, s, Vt = np.linalg.svd(B / size[:, None])
    rank = int((s > RANK * s[0]).sum())
    if rank < len(B):
        raise ValueError(
            f"the coordinates of the body represent {rank} of the {len(B)} independent motions of its interfaces "
            f"{list(interfaces)}; reduce it with craig_bampton and these interfaces, or name fewer"
        )
    N = Vt[rank:].T
    particular = np.linalg.pinv(B / size[:, None]) / size
    inner = N.T @ K @ N
    constraint = (
        particular - N @ linalg.solve(inner, N.T @ K @ particular, assume_a="sym") if N.shape[1] else particular
    )
    if not N.shape[1]:
        return constraint
    modes = N @ linalg.eigh((inner + inner.T) / 2, N.T @ M @ N)[1]
    return np.column_stack(
        [constraint, modes * np.where(modes[np.abs(modes).argmax(axis=0), np.arange(modes.shape[1])] < 0, -1, 1)]
    )


def _clean(A: Array) -> Array:
    """The symmetric part of A; entries that are rounding compared with the diagonal are set to zero."""
    A = (A + A.T) / 2
    d = np.sqrt(np.abs(np.diag(A)))
    return np.where(np.abs(A) > 1e-13 * np.outer(d, d), A, 0.0)


def _recovery(body: FlexibleBody, X: Array) -> Recovery | None:
    """Displacement of the drawn points per dof of the model; None if the body has no skin."""
    if body.skin is None:
        return None
    points, shapes = body.skin.points, body.skin.shapes
    rows = np.zeros((len(points), 3, 6 + len(shapes)))
    rows[:, :, :3] = np.eye(3)
    rows[:, :, 3:6] = np.cross(np.eye(3)[None], points[:, None]).swapaxes(1, 2)
    rows[:, :, 6:] = shapes.transpose(1, 2, 0)
    return Recovery(points, sparse.csr_array(rows.reshape(-1, X.shape[0]) @ X))
