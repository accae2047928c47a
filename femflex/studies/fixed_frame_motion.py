"""Elastic motion of a body with a fixed frame: Me q'' + f(q) = 0, or on the manifold of its dependent shapes.

With the amplitudes eta = (q, y) of all shapes, y_s = 1/2 q.A_s q, Y = d(eta)/dq and g_s = q'.A_s q' (condensed form,
THEORY section 3), T = 1/2 eta'.Me eta' gives

    f(q) + Y^T Me (Y q'' + g) = 0,

f being the force of the strain tensors. If A is empty there are no dependent shapes: Y = 1 and g = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody


@dataclass(frozen=True, eq=False)
class FixedFrameMotion:
    """Forces of a body's motion at many instants, and their derivatives; damping is left out."""

    body: FlexibleBody

    @cached_property
    def mass(self) -> Array:
        """Elastic mass Me (n + n_s, n + n_s) [1] of all shapes."""
        return self.body.moments.elastic_mass()

    @cached_property
    def followers(self) -> Array:
        """A (n_s, n, n) [kg^-1/2 m^-1]."""
        n = self.body.n_modes
        return self.body.slaves.reshape(-1, n, n)

    def elastic(self, q: Array) -> Array:
        """Elastic forces (t, n) [kg^1/2 m/s^2] at coordinates (t, n)."""
        return np.stack([self.body.strain.force(row) for row in q])

    def inertia(self, q: Array, q1: Array, q2: Array) -> Array:
        """Inertia forces Y^T Me (Y q'' + g), (t, n) [kg^1/2 m/s^2], from coordinates and their first and second
        derivatives (t, n)."""
        Y = self.tangent_basis(q)
        return np.einsum("tai,ta->ti", Y, self._momentum_rate(Y, q1, q2))

    def tangent_basis(self, q: Array) -> Array:
        """Y (t, n + n_s, n) [1]."""
        return np.concatenate([self._ones(len(q)), np.einsum("sij,tj->tsi", self.followers, q)], axis=1)

    def slopes(self, q: Array, q1: Array, q2: Array, square: float) -> tuple[Array, Array, Array]:
        """Derivatives (t, n, n) [SI] of elastic + square inertia forces by q, q' and q''."""
        A, n = self.followers, self.body.n_modes
        Y = self.tangent_basis(q)
        pulled = np.einsum("tai,ab->tib", Y, self.mass)
        followed = self._momentum_rate(Y, q1, q2)[:, n:]
        turned = np.einsum("ts,sij->tij", followed, A) + np.einsum("tis,sjk,tk->tij", pulled[:, :, n:], A, q2)
        tangent = np.stack([self.body.strain.tangent(row) for row in q])
        by_rate = 2 * np.einsum("tis,sjk,tk->tij", pulled[:, :, n:], A, q1)
        return tangent + square * turned, square * by_rate, square * np.einsum("tib,tbj->tij", pulled, Y)

    def _momentum_rate(self, Y: Array, q1: Array, q2: Array) -> Array:
        """Me (Y q'' + g), (t, n + n_s)."""
        second = np.einsum("tai,ti->ta", Y, q2)
        second[:, self.body.n_modes :] += np.einsum("ti,sij,tj->ts", q1, self.followers, q1, optimize=True)
        return second @ self.mass

    def _ones(self, count: int) -> Array:
        n = self.body.n_modes
        return np.broadcast_to(np.eye(n), (count, n, n))
