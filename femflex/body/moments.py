"""Mass moments of a flexible body over its shapes, from which its inertia follows, and its points of mass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class MassMoments:
    """Mass moments of a flexible body over its shapes z = (rho, phi_1, ..., phi_n), body frame (THEORY section 3).

    mass    ()                     int dm       [kg]
    first   (1 + n, 3)             int z dm     [kg m | kg^1/2]
    second  (1 + n, 3, 1 + n, 3)   int z z^T dm [kg m^2 | kg^1/2 m | 1]

    With y = (1, delta) a material point sits at r = z_A y_A. Units in brackets hold for mass-normalised shapes.
    """

    mass: float
    first: Array
    second: Array

    @property
    def n_modes(self) -> int:
        """Number of shapes n."""
        return self.first.shape[0] - 1

    def center_of_mass(self, delta: Array | None = None) -> Array:
        """Centre of mass s y / mass in the body frame, (3,) [m]."""
        return self._extended(delta) @ self.first / self.mass

    def inertia(self, delta: Array | None = None) -> Array:
        """Inertia about the body frame's origin, J = tr(Q) 1 - Q, (3, 3) [kg m^2]."""
        y = self._extended(delta)
        Q = np.einsum("AaBb,A,B->ab", self.second, y, y)
        return np.trace(Q) * np.eye(3) - Q

    def elastic_mass(self) -> Array:
        """Elastic mass Me[k, l] = P[k, a, l, a], (n, n)."""
        return np.einsum("kala->kl", self.second[1:, :, 1:, :])

    def acceleration_loads(self) -> Array:
        """Work (n, 6) of the inertia of unit accelerations of the body frame, linear then angular, on the shapes."""
        Q = self.second[0][:, 1:]
        angular = [Q[b, :, c] - Q[c, :, b] for b, c in ((1, 2), (2, 0), (0, 1))]  # int r x phi dm
        return np.column_stack([self.first[1:], *angular])

    def _extended(self, delta: Array | None) -> Array:
        return np.concatenate([[1.0], np.zeros(self.n_modes) if delta is None else np.asarray(delta, float)])


@dataclass(frozen=True, eq=False)
class MassPoints:
    """Masses dm (p,) [kg] at rho (p, 3) [m] of the undeformed body, moved by shapes phi (p, 3, n)."""

    dm: Array
    rho: Array
    phi: Array

    def transformed(self, X: Array) -> MassPoints:
        """The same points over the shapes phi X, X (n, m)."""
        return replace(self, phi=self.phi @ X)

    def with_shapes(self, shapes: IntArray) -> MassPoints:
        """The same points over the selected shapes (k,) alone."""
        return replace(self, phi=self.phi[:, :, shapes])


def points_of_moments(moments: MassMoments) -> MassPoints:
    """Six points with the mass, first moments and inertia of a body; each moves with the mean of every shape.

    int r r^T dm about the centre of mass = sum_k q_k v_k v_k^T; a pair of points m/6 at +-sqrt(3 q_k / m) v_k each.
    """
    m, centre = moments.mass, moments.first[0] / moments.mass
    Q = moments.second[0][:, 0] - m * np.outer(centre, centre)
    value, axes = np.linalg.eigh((Q + Q.T) / 2)
    arms = (np.sqrt(3 * np.maximum(value, 0.0) / m) * axes).T
    phi = np.broadcast_to(moments.first[1:].T / m, (6, 3, moments.n_modes))
    return MassPoints(np.full(6, m / 6), centre + np.concatenate([arms, -arms]), phi)
