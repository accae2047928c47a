"""A body from given points and matrices, with no mesh: nodes with three translations each."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from femflex.body import FlexibleBody, MassMoments, Skin, StrainTensors
from femflex.reduction.boundary.markers import MarkerRows, marker, mean_rows, rotation_fit
from femflex.reduction.boundary.rigid import check_no_rigid_motion, rigid_motion
from femflex.reduction.inertia.moments import linear_stiffness
from femflex.reduction.modes.damping import Damping, ModalDamping

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ISOTROPIC = 1e-9  # relative difference of the three axes' masses still taken as rounding


def body_from_matrices(
    X: Array,
    M: sparse.csr_array,
    K: sparse.csr_array,
    phi: Array,
    markers: Mapping[str, Index] | None = None,
    damping: Damping | None = None,
    cells: Mapping[str, Index] | None = None,
    omega: Array | None = None,
    kinds: tuple[str, ...] | None = None,
) -> FlexibleBody:
    """The FlexibleBody of nodes X (n, 3) with matrices M, K (3n, 3n), dof 3 * node + axis, and shapes phi (3n, k).

    Exact for a mass matrix of translations: P[A, a, B, b] = z_Aa^T Mn z_Bb with Mn the mass of one axis (THEORY
    section 3). markers: name -> nodes (mean displacement and least-squares rotation). cells: what is drawn, over X.
    Raises ValueError on shapes of arrays that do not fit, and on a mass matrix that is not alike along the three axes.
    """
    X, M, K = np.asarray(X, float), sparse.csr_array(M), sparse.csr_array(K)
    _check_sizes(X, M, K, phi)
    Mn = _one_axis(M)
    z = np.concatenate([X[:, :, None], phi.reshape(len(X), 3, -1)], axis=2)  # node, axis, 1 + k
    Mz = (Mn @ z.reshape(len(X), -1)).reshape(z.shape)
    k = phi.shape[1]
    second = (z.reshape(len(X), -1).T @ Mz.reshape(len(X), -1)).reshape(3, 1 + k, 3, 1 + k).transpose(1, 0, 3, 2)
    moments = MassMoments(float(Mn.sum()), Mz.sum(axis=0).T, second)
    diagonal = K.diagonal()
    weight = np.sqrt(np.maximum(diagonal, 1e-12 * diagonal.max(initial=0.0)))
    check_no_rigid_motion(rigid_motion(X)[0].reshape(-1, 6), phi, weight)
    V1 = linear_stiffness(K, phi)
    return FlexibleBody(
        moments=moments,
        strain=StrainTensors.linear(V1),
        damping=(damping or ModalDamping(0.0)).matrix(moments.elastic_mass(), V1),
        markers={
            name: marker(_rows(X, np.asarray(nodes, np.int64)), phi, name) for name, nodes in (markers or {}).items()
        },
        skin=Skin(X, dict(cells or {"vertex": np.arange(len(X))[:, None]}), z[:, :, 1:].transpose(2, 0, 1).copy()),
        kinds=kinds or ("vibration" if omega is not None else "nodal",) * k,
        omega=np.full(k, np.nan) if omega is None else np.asarray(omega, float),
    )


def _check_sizes(X: Array, M: sparse.csr_array, K: sparse.csr_array, phi: Array) -> None:
    n = 3 * len(X)
    for name, shape in (("M", M.shape), ("K", K.shape)):
        if shape != (n, n):
            raise ValueError(
                f"{name} is {shape[0]} x {shape[1]}, but {len(X)} nodes with three translations need {n} x {n}."
            )
    if phi.ndim != 2 or phi.shape[0] != n:
        raise ValueError(f"phi has shape {phi.shape}; shapes over {len(X)} nodes have {n} rows, one column each.")


def _one_axis(M: sparse.csr_array) -> sparse.csr_array:
    """Mass matrix of one axis (n, n), the same for all three."""
    Mn = M[0::3][:, 0::3]
    rest = M - sparse.kron(Mn, sparse.eye_array(3))
    if abs(rest).max() > ISOTROPIC * abs(M).max():
        raise ValueError(
            "the mass matrix is not alike along the three axes, or couples them "
            f"(differences up to {abs(rest).max():.3g} kg, with masses of {abs(M).max():.3g} kg); "
            "give a mass matrix of translations, dofs ordered 3 * node + axis."
        )
    return sparse.csr_array(Mn)


def _rows(X: Array, nodes: Index) -> MarkerRows:
    """Marker rows of nodes that have translations alone."""
    position = X[nodes].mean(axis=0)
    columns = (3 * nodes[:, None] + np.arange(3)).ravel()
    pick = sparse.csr_array((np.ones(columns.size), (np.arange(columns.size), columns)), shape=(columns.size, X.size))
    fit, hidden = rotation_fit(X[nodes] - position)
    mean = sparse.csr_array(mean_rows(np.ones(len(nodes))))
    return MarkerRows(position, (mean @ pick).tocsr(), (sparse.csr_array(fit) @ pick).tocsr(), hidden, False)
