"""The condensed form of a body (quadratic manifold): shapes that follow bending statically are no coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody, MassMoments, StrainTensors
from femflex.body.symmetric import packed, picked, unpacked

Array = NDArray[np.float64]
Index = NDArray[np.int64]

DEPENDENT = 1e-12  # of the largest eigenvalue of V1 over the slaved shapes; below it a combination carries no strain
UNCOUPLED = 1e-12  # of the two shapes' stiffness: what couples them below it is rounding
BALANCED = 1e-9  # initial force on a slaved shape, against its stiffness times a unit amplitude


def condense(body: FlexibleBody, slaved: Sequence[int] | Index) -> FlexibleBody:
    """The body with those shapes (numbered from 0) slaved to the others: y = 1/2 delta.A delta.

    The slaved amplitudes are where the strain energy is least to second order in delta, A_s = -6 V1_ss^-1 V2_s; the
    other shapes first take on what the slaved ones do in answer to them to first order. What is left of V is exact to
    the fourth order, V3 - 1/4 A V1_ss A in place of V3; the stiffness that would hold the slaved shapes is gone, and
    their inertia stays (dynamics.slaves).

    Raises ValueError when the body has linear strain or slaved shapes already, when no coordinate or no slaved shape
    is left, when shapes depend on each other, or when an initial stress pushes a slaved shape.
    """
    slaved = np.unique(np.asarray(slaved, np.int64))
    _check(body, slaved)
    n = body.n_modes
    free = np.setdiff1d(np.arange(n), slaved)
    V1 = (body.strain.V1 + body.strain.V1.T) / 2
    stiffness, V1_sf = V1[np.ix_(slaved, slaved)], V1[np.ix_(slaved, free)]
    _check_stiffness(body, slaved, stiffness)
    X = np.zeros((n, n))
    X[free, np.arange(len(free))] = 1.0
    X[slaved, len(free) + np.arange(len(slaved))] = 1.0
    size = np.sqrt(np.outer(np.diag(stiffness), np.diag(V1)[free]))
    if np.any(np.abs(V1_sf) > UNCOUPLED * size):
        X[slaved, : len(free)] = -np.linalg.solve(stiffness, V1_sf)
    strain, slaves = _condensed_strain(body.strain, X, len(free), stiffness)
    order = np.concatenate([free, slaved])
    return replace(
        body,
        **recombined(body, X, len(free)),
        strain=strain,
        damping=X[:, : len(free)].T @ body.damping @ X[:, : len(free)],
        kinds=tuple(body.kinds[k] for k in order) if body.kinds else (),
        omega=body.omega[order] if body.omega.size else body.omega,
        slaves=slaves,
    )


def recombined(body: FlexibleBody, X: Array, leading: int) -> dict[str, Any]:
    """Moments, markers, skin and strain field over the shapes phi X, X (n, m); leading as of StrainPart."""
    Z = np.zeros((1 + X.shape[0], 1 + X.shape[1]))
    Z[0, 0], Z[1:, 1:] = 1.0, X
    moments, skin = body.moments, body.skin
    second = np.einsum("AaBb,AC,BD->CaDb", moments.second, Z, Z, optimize=True)
    return {
        "moments": MassMoments(moments.mass, Z.T @ moments.first, second),
        "markers": {key: replace(m, phi=m.phi @ X, psi=m.psi @ X) for key, m in body.markers.items()},
        "skin": None if skin is None else replace(skin, shapes=np.einsum("kpa,kl->lpa", skin.shapes, X, optimize=True)),
        "strain_field": tuple(part.mixed(X, leading) for part in body.strain_field),
    }


def _condensed_strain(strain: StrainTensors, X: Array, n: int, stiffness: Array) -> tuple[StrainTensors, Array]:
    """Strain tensors over the first n of the shapes phi X with the others relaxed, and A (n_s, n, n)."""
    size, F, S = len(X), X[:, :n], X[:, n:]
    mixed = np.count_nonzero(F) > n
    V2 = unpacked(strain.V2, size, 3) if strain.V2.size else np.zeros((size,) * 3)
    V2_F = np.einsum("ijk,ja,kb->iab", V2, F, F, optimize=True)
    A = -6.0 * np.linalg.solve(stiffness, np.tensordot(S.T, V2_F, axes=1).reshape(X.shape[1] - n, -1)).reshape(-1, n, n)
    V3 = np.zeros((n,) * 4)
    if strain.V3.size and not mixed:
        at = np.argmax(F, axis=0)
        V3 = unpacked(picked(strain.V3, size, at, 4), n, 4)
    elif strain.V3.size:
        V3 = np.einsum("ijkl,ia,jb,kc,ld->abcd", unpacked(strain.V3, size, 4), F, F, F, F, optimize=True)
    V3 = V3 - 0.25 * np.einsum("sij,st,tkl->ijkl", A, stiffness, A, optimize=True)
    V1 = F.T @ strain.V1 @ F
    return StrainTensors(V1, F.T @ strain.f0, packed(np.tensordot(F.T, V2_F, axes=1)), packed(V3)), np.asarray(A, float)


def _check(body: FlexibleBody, slaved: Index) -> None:
    n = body.n_modes
    if len(body.slaves):
        raise ValueError("the body is condensed already; condense the one it was made from.")
    if body.strain.is_linear:
        raise ValueError(
            "a body with linear strain has nothing that couples bending to stretch; give it V2 and V3 "
            "(strain = 'nonlinear') before it is condensed."
        )
    if not len(slaved) or len(slaved) >= n or slaved[0] < 0 or slaved[-1] >= n:
        raise ValueError(
            f"{len(slaved)} of {n} shapes were to follow the others, numbers {slaved.tolist()}; "
            f"name at least one from 0 to {n - 1}, and leave at least one coordinate."
        )


def _check_stiffness(body: FlexibleBody, slaved: Index, stiffness: Array) -> None:
    eigenvalues = np.linalg.eigvalsh(stiffness)
    if not eigenvalues[0] > DEPENDENT * eigenvalues[-1]:
        raise ValueError(
            f"the slaved shapes depend on each other or carry no strain: the eigenvalues of their stiffness run from "
            f"{eigenvalues[0]:.3g} to {eigenvalues[-1]:.3g}; leave out shapes that others already hold."
        )
    push = np.abs(body.strain.f0[slaved]).max()
    if push > BALANCED * eigenvalues[0]:
        raise ValueError(
            f"an initial stress pushes the slaved shapes by up to {push:.3g} (stiffness from {eigenvalues[0]:.3g}); "
            "the condensed form needs initial stress in balance. Keep these shapes as coordinates."
        )
