"""Effective masses of the modes of a body, and the modal assurance criterion (MAC) of two sets of shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.fem.eigen.shift_invert import canonical_modes, dense_modes

LEVI_CIVITA = np.array([[[(a - b) * (b - c) * (c - a) / 2 for c in range(3)] for b in range(3)] for a in range(3)])


@dataclass(frozen=True, eq=False)
class EffectiveMass:
    """Participation of a body's own modes in its rigid motions, columns x, y, z, rx, ry, rz.

    omega          (n,)    natural frequencies of the body with its frame fixed [rad/s]
    participation  (n, 6)  phi^T M R of the mass-normalised modes [kg^1/2 | kg^1/2 m]
    total          (6,)    mass of the rigid body, three times, and its moments of inertia [kg | kg m^2]
    shapes         (n, n)  amplitudes of the elastic coordinates (rows) in each mode
    kinds          (n,)    kind of the shape with the largest mass in each mode; empty if the body has no kinds
    """

    omega: Array
    participation: Array
    total: Array
    shapes: Array
    kinds: tuple[str, ...] = ()

    @property
    def effective(self) -> Array:
        """Effective mass of each mode, participation squared, (n, 6) [kg | kg m^2]."""
        return self.participation**2

    @property
    def running(self) -> Array:
        """The running sum (n, 6) [1] of effective mass over total; zero where the total is zero."""
        return np.cumsum(self.effective, axis=0) / np.where(self.total > 0, self.total, np.inf)

    @property
    def carried_fraction(self) -> Array:
        """The fraction (6,) [1] of the total that is the effective mass of all modes."""
        return self.running[-1] if len(self.omega) else np.zeros(6)


def effective_mass(body: FlexibleBody, about: Array | None = None) -> EffectiveMass:
    """Effective masses of a body along its axes and about axes through a point `about` (3,) [m] (default: the
    frame's origin).

    From the moments alone: int phi_k dm, and int (r - about) x phi_k dm. Shapes that are not modes (nodal, constraint,
    admissible) are first recombined into the modes of V1 and Me; the shape with most part in a mode counts positive.
    """
    point = np.zeros(3) if about is None else np.asarray(about, float)
    body = body.without_slaves()
    moments, n = body.moments, body.n_modes
    s = moments.first[1:]
    turning = np.einsum("abc,bkc->ka", LEVI_CIVITA, moments.second[0, :, 1:, :]) - np.cross(point, s)
    c = moments.first[0] / moments.mass
    J = moments.inertia() + moments.mass * (_steiner(c - point) - _steiner(c))
    total = np.concatenate([np.full(3, moments.mass), np.diag(J)])
    if not n:
        return EffectiveMass(np.zeros(0), np.zeros((0, 6)), total, np.zeros((0, 0)))
    eigenvalues, X = dense_modes(body.strain.V1, moments.elastic_mass())
    X = canonical_modes(eigenvalues, X)
    participation = X.T @ np.concatenate([s, turning], axis=1)
    share = X * (moments.elastic_mass() @ X)
    kinds = tuple(body.kinds[k] for k in np.argmax(share, axis=0)) if body.kinds else ()
    return EffectiveMass(np.sqrt(np.maximum(eigenvalues, 0.0)), participation, total, X, kinds)


def mac(phi: Array, psi: Array, M: sparse.csr_array | None = None) -> Array:
    """Modal assurance criterion (n, m), (phi^T M psi)^2 / (phi^T M phi)(psi^T M psi), of shapes in columns.

    Zero for a shape that moves nothing.
    """
    M_phi, M_psi = (phi, psi) if M is None else (M @ phi, M @ psi)
    size = np.outer(np.einsum("in,in->n", phi, M_phi), np.einsum("in,in->n", psi, M_psi))
    return (phi.T @ M_psi) ** 2 / np.where(size > 0, size, np.inf)


def mac_of_bodies(body: FlexibleBody, other: FlexibleBody, tolerance: float = 0.05) -> Array:
    """Modal assurance criterion (n, m) of two bodies' shapes, unweighted at the points of the first body's skin.

    Each point is compared with the other skin's nearest point. Raises ValueError when a body has no skin, or one of
    these lies further off than `tolerance` times the first body's size.
    """
    body, other = body.without_slaves(), other.without_slaves()
    if body.skin is None or other.skin is None:
        raise ValueError(
            "shapes of two bodies are compared on their skins, and one of them has none; reduce it from a mesh."
        )
    found = KDTree(other.skin.points).query(body.skin.points)
    distance, nearest = np.asarray(found[0], float), np.asarray(found[1], np.int64)
    size = float(np.linalg.norm(np.ptp(body.skin.points, axis=0)))
    if distance.max() > tolerance * size:
        raise ValueError(
            f"the two bodies do not lie on each other: a point of the first is {distance.max():.3g} m from the nearest "
            f"of the second, where {tolerance * size:.3g} m is allowed. Give both the same body frame."
        )
    phi = body.skin.shapes.reshape(body.n_modes, -1).T
    return mac(phi, other.skin.shapes[:, nearest].reshape(other.n_modes, -1).T)


def _steiner(r: Array) -> Array:
    return (r @ r) * np.eye(3) - np.outer(r, r)
