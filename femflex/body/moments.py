"""Mass moments of a flexible body over its shapes, from which its inertia follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array


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
