"""The condensed form of a body (quadratic manifold): shapes that follow bending statically are no coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody, MassMoments, StrainTensors
from femflex.body.symmetric import packed, packed_size, picked, unpacked

Array = NDArray[np.float64]
Index = NDArray[np.int64]

DEPENDENT = 1e-12  # of the largest eigenvalue of V1 over the slaved shapes; below it a combination carries no strain
UNCOUPLED = 1e-12  # of the two shapes' stiffness: what couples them below it is rounding
BALANCED = 1e-9  # initial force on a slaved shape, against its stiffness times a unit amplitude


def condense(
    body: FlexibleBody, slaved: Sequence[int] | Index, quartic: Callable[[Index], Array] | None = None
) -> FlexibleBody:
    """The body with those shapes (numbered from 0) slaved to the others: y = 1/2 delta.A delta.

    The slaved shapes first lose what the others store in common with them, V1_fs = 0, and the others stay as they are:
    what these can do under loads, end moments of a member among them, the body can still do. The slaved amplitudes are
    where the strain energy is least to second order in delta, A_s = -6 V1_ss^-1 V2_s. What is left of V is exact to the
    fourth order, V3 - 1/4 A V1_ss A in place of V3; the stiffness that would hold the slaved shapes is gone, and their
    inertia stays (dynamics.slaves). Sections that follow already go on following the others. quartic: packed V3 over
    the coordinates that stay, given their numbers, for a body that holds none itself.

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
        X[free, len(free) :] = -np.linalg.lstsq(V1[np.ix_(free, free)], V1_sf.T, rcond=None)[0]
    strain, slaves = _condensed_strain(body.strain, X, free, quartic)
    order = np.concatenate([free, slaved, np.arange(n, body.n_shapes)])
    m = len(body.slaves)
    whole = np.block([[X, np.zeros((n, m))], [np.zeros((m, n)), np.eye(m)]])
    slaves = np.concatenate([slaves, body.slaves[:, free][:, :, free]]) if m else slaves
    return replace(
        body,
        **recombined(body, whole, len(free)),
        strain=strain,
        damping=body.damping[np.ix_(free, free)],
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


def _condensed_strain(
    strain: StrainTensors, X: Array, free: Index, quartic: Callable[[Index], Array] | None
) -> tuple[StrainTensors, Array]:
    """Strain tensors over the free shapes with the last of the shapes phi X relaxed, and A (n_s, n, n)."""
    size, n, S = len(X), len(free), X[:, len(free) :]
    V2 = unpacked(strain.V2, size, 3)[:, free][:, :, free] if strain.V2.size else np.zeros((size, n, n))
    stiffness = S.T @ ((strain.V1 + strain.V1.T) / 2) @ S
    driven = np.tensordot(S.T, V2, axes=1).reshape(size - n, -1)
    A = np.asarray(-6.0 * np.linalg.solve(stiffness, driven), float).reshape(-1, n, n)
    if quartic is not None:
        V3 = quartic(free)
    else:
        V3 = picked(strain.V3, size, free, 4) if strain.V3.size else np.zeros(packed_size(n, 4))
    V3 = V3 - packed(0.25 * np.einsum("sij,st,tkl->ijkl", A, stiffness, A, optimize=True))
    return StrainTensors(strain.V1[np.ix_(free, free)], strain.f0[free], packed(V2[free]), V3), A


def _check(body: FlexibleBody, slaved: Index) -> None:
    n = body.n_modes
    if body.condensed:
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
