"""Mass points of a body, at which fields that are not linear in position are evaluated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body.moments import MassMoments


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
