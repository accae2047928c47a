"""Point masses that have all mass moments of a flexible body, and moments from them.

The moments are the Gram matrix of w = (1, rho, phi_1, ..., phi_n). With the eigenvalues q_k and eigenvectors v_k of its
covariance about the mean of w, K of them not zero, the pairs of points at mean +- sqrt(K q_k / m) v_k with the mass
m / 2 K each have the same matrix.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments
from femflex.body.moments import MassPoints

LEAST = 1e-14  # of the largest eigenvalue, scaled to a diagonal of 1, that counts as zero


def lumped_masses(moments: MassMoments) -> MassPoints:
    """Point masses with these moments, to rounding; the points stand for no material ones."""
    n, m = moments.n_modes, moments.mass
    mean = moments.first.ravel() / m
    covariance = moments.second.reshape(3 * (1 + n), -1) - m * np.outer(mean, mean)
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(scale > 0.0, scale, 1.0)
    value, vectors = np.linalg.eigh((covariance + covariance.T) / 2 / scale / scale[:, None])
    active = value > LEAST * value.max(initial=0.0)
    K = int(active.sum())
    if not K:
        return MassPoints(np.array([m]), mean[None, :3], mean[None, 3:].reshape(1, n, 3).swapaxes(1, 2))
    arms = (np.sqrt(K * value[active] / m) * vectors[:, active] * scale[:, None]).T
    points = mean + np.concatenate([arms, -arms])
    return MassPoints(np.full(2 * K, m / (2 * K)), points[:, :3], points[:, 3:].reshape(2 * K, n, 3).swapaxes(1, 2))


def moments_of(points: MassPoints) -> MassMoments:
    """The mass moments of point masses."""
    z = np.concatenate([points.rho[:, None], points.phi.swapaxes(1, 2)], axis=1)  # point, shape, axis
    first = np.einsum("p,pka->ka", points.dm, z)
    return MassMoments(float(points.dm.sum()), first, np.einsum("p,pka,plb->kalb", points.dm, z, z))


def linear_body(body: FlexibleBody, name: str) -> tuple[FlexibleBody, list[str]]:
    """The body with linear strain, and what is worth saying of what is left out, as lines.

    Raises ValueError for a rigid body.
    """
    if not body.n_modes:
        raise ValueError(f"body {name!r} is rigid; the file of a flexible body needs shapes. Give the program its mass")
    said = []
    if body.strain_form != "linear":
        said = [f"its {body.strain_form} strain is taken to first order, without the stiffness that stress adds"]
    elif body.foreshortening is not None:
        said = ["without the stiffness that spin, thrust and tension add"]
    return body.with_linear_strain(), said


def skew(vectors: Array) -> Array:
    """Matrices (..., 3, 3), in the unit of vectors (..., 3), that multiply as cross products with them do."""
    x, y, z = np.moveaxis(np.asarray(vectors, float), -1, 0)
    zero = np.zeros_like(x)
    rows = [np.stack(row, -1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))]
    return np.stack(rows, -2)
