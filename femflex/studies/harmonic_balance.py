"""Free vibration at finite amplitude of a body with a fixed frame, by harmonic balance.

With the amplitudes eta = (q, y) of all shapes, y_s = 1/2 q.A_s q, Y = d(eta)/dq and g_s = q'.A_s q' (condensed form,
THEORY section 3), T = 1/2 eta'.Me eta' gives f(q) + Y^T Me (Y q'' + g) = 0, f being the force of the strain tensors;
without dependent shapes Y = 1 and g = 0. A motion at rest at t = 0 is even in time, q = sum_k c_k cos(k omega t), and
every harmonic must balance,

    (2 - [k = 0]) / T int (f + Y^T Me (Y q'' + g)) cos(k omega t) dt = 0,

with a prescribed displacement of one point at t = 0. The same motion with 1/k of its frequency is a solution as well,
with its k-th harmonic in place of the first: `backbone` distinguishes these.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody

STEPS = 12  # of Newton's method, which starts near the solution
SINGULAR = 1e-11  # of the largest singular value, rows and columns scaled alike
CONVERGED = 1e-9  # unbalanced forces over the forces, and error of the amplitude


@dataclass(frozen=True, eq=False)
class Vibration:
    """A free vibration: amplitude () [m], omega () [rad/s], and its harmonics c (h, n)."""

    amplitude: float
    omega: float
    harmonics: Array

    @property
    def x(self) -> Array:
        """Harmonics [kg^1/2 m] and frequency [rad/s] (n_x,), n_x = h n + 1."""
        return np.append(self.harmonics.ravel(), self.omega)


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
        return self.body.slaves.reshape(-1, self.body.n_modes, self.body.n_modes)

    def elastic(self, q: Array) -> Array:
        """Elastic forces (t, n) [kg^1/2 m/s^2] at coordinates (t, n)."""
        return np.stack([self.body.strain.force(row) for row in q])

    def tangent_basis(self, q: Array) -> Array:
        """Y (t, n + n_s, n) [1]."""
        n = self.body.n_modes
        ones = np.broadcast_to(np.eye(n), (len(q), n, n))
        return np.concatenate([ones, np.einsum("sij,tj->tsi", self.followers, q)], axis=1)

    def inertia(self, q: Array, q1: Array, q2: Array) -> Array:
        """Inertia forces Y^T Me (Y q'' + g), (t, n) [kg^1/2 m/s^2], from coordinates and their first and second
        derivatives (t, n)."""
        Y = self.tangent_basis(q)
        return np.einsum("tai,ta->ti", Y, self._momentum_rate(Y, q1, q2))

    def slopes(self, q: Array, q1: Array, q2: Array, square: float) -> tuple[Array, Array, Array]:
        """Derivatives (t, n, n) [SI] of elastic + square inertia forces by q, q' and q''."""
        A, Y, n = self.followers, self.tangent_basis(q), self.body.n_modes
        pulled = np.einsum("tai,ab->tib", Y, self.mass)
        moved = pulled[:, :, n:]
        turned = np.einsum("ts,sij->tij", self._momentum_rate(Y, q1, q2)[:, n:], A)
        turned += np.einsum("tis,sjk,tk->tij", moved, A, q2)
        by_rate = 2 * np.einsum("tis,sjk,tk->tij", moved, A, q1)
        tangent = np.stack([self.body.strain.tangent(row) for row in q])
        return tangent + square * turned, square * by_rate, square * np.einsum("tib,tbj->tij", pulled, Y)

    def _momentum_rate(self, Y: Array, q1: Array, q2: Array) -> Array:
        """Me (Y q'' + g), (t, n + n_s)."""
        second = np.einsum("tai,ti->ta", Y, q2)
        second[:, self.body.n_modes :] += np.einsum("ti,sij,tj->ts", q1, self.followers, q1, optimize=True)
        return second @ self.mass


@dataclass(frozen=True, eq=False)
class HarmonicBalance:
    """The equations of a body's motion, and the row over all shapes that gives its amplitude."""

    motion: FixedFrameMotion
    row: Array

    def balanced(self, start: Vibration, normal_row: Array | None = None) -> Vibration | None:
        """The motion near a start that has its amplitude; None if none is found.

        normal_row: row (n_x,) [1/(kg^1/2 m), s/rad] over harmonics and frequency, to which the change from the start is
        orthogonal instead.
        """
        c, omega = start.harmonics, start.omega
        waves, projection = _cosine_matrices(len(c))
        K = self.motion.body.strain.tangent(np.zeros(c.shape[1]))
        for _ in range(STEPS):
            q, q1, q2 = (wave @ c for wave in waves)
            force = projection @ self.motion.elastic(q)
            residual = force + omega**2 * (projection @ self.motion.inertia(q, q1, q2))
            if not np.isfinite(residual).all():
                return None
            amplitude, size = self.amplitude_and_gradient(c.sum(axis=0))[0], 1.0
            if normal_row is None:
                error, size = start.amplitude - amplitude, start.amplitude
            else:
                error = float(normal_row @ (start.x - np.append(c.ravel(), omega)))
            if abs(error) < CONVERGED * size and _energy(K, residual) < CONVERGED**2 * _energy(K, force):
                return Vibration(start.amplitude if normal_row is None else amplitude, omega, c)
            step = _least_change(self.jacobian(c, omega, normal_row), np.append(-residual.ravel(), error))
            c, omega = c + step[:-1].reshape(c.shape), omega + float(step[-1])
        return None

    def tangent(self, vibration: Vibration, row: Array | None = None) -> Array:
        """Direction (n_x,) [kg^1/2 m, rad/s] over harmonics and frequency of the next motions: 1 along a row, or per
        amplitude.
        """
        right = np.append(np.zeros(vibration.harmonics.size), 1.0)
        return _least_change(self.jacobian(vibration.harmonics, vibration.omega, row), right)

    def jacobian(self, c: Array, omega: float, last_row: Array | None = None) -> Array:
        """Derivatives (n_x, n_x) [SI] of the unbalanced forces by harmonics and frequency, and a last row.

        By default the last row is the derivative of the amplitude.
        """
        waves, projection = _cosine_matrices(len(c))
        q, q1, q2 = (wave @ c for wave in waves)
        inertia = projection @ self.motion.inertia(q, q1, q2)
        J = sum(
            np.einsum("kt,tij,tl->kilj", projection, slope, wave, optimize=True)
            for slope, wave in zip(self.motion.slopes(q, q1, q2, omega**2), waves, strict=True)
        ).reshape(c.size, c.size)
        row = self.amplitude_row(c) if last_row is None else last_row
        return np.concatenate([np.column_stack([J, 2 * omega * inertia.reshape(-1, 1)]), row[None]])

    def amplitude_row(self, c: Array) -> Array:
        """Derivative (n_x,) of the amplitude [m] by harmonics c (h, n) and frequency."""
        return np.append(np.tile(self.amplitude_and_gradient(c.sum(axis=0))[1], len(c)), 0.0)

    def amplitude_and_gradient(self, q: Array) -> tuple[float, Array]:
        """The amplitude [m] at coordinates (n,), and its gradient (n,)."""
        return float(self.row @ self.motion.body.amplitudes(q)), self.row @ self.motion.tangent_basis(q[None])[0]

    def weights(self, harmonics: Array) -> Array:
        """Twice the mean square (h,) [kg m^2] of each harmonic (h, n), weighed by mass."""
        n = harmonics.shape[1]
        return np.einsum("ki,ij,kj->k", harmonics, self.motion.mass[:n, :n], harmonics)

    def metric_row(self, vibration: Vibration, change: Array) -> Array:
        """The row (n_x,) whose product with another change is the inner product with this one.

        |dx|^2 = sum_k dc_k.Me dc_k / sum_k c_k.Me c_k + (d omega / omega)^2: a length of 0.1 changes by a tenth.
        """
        h, n = vibration.harmonics.shape
        size = self.weights(vibration.harmonics).sum()
        weighed = change[:-1].reshape(h, n) @ self.motion.mass[:n, :n]
        return np.append(weighed.ravel() / size, change[-1] / vibration.omega**2)


def _cosine_matrices(h: int) -> tuple[tuple[Array, Array, Array], Array]:
    """Cosines of h harmonics with two derivatives by phase (t, h), and the projection on harmonics (h, t)."""
    phase = 2 * np.pi * np.arange(4 * h) / (4 * h)  # products of four harmonics below h are distinguished
    order = np.arange(h)
    cosine, sine = np.cos(np.outer(phase, order)), np.sin(np.outer(phase, order))
    projection = cosine.T * np.where(order == 0, 1.0, 2.0)[:, None] / len(phase)
    return (cosine, -order * sine, -(order**2) * cosine), projection


def _energy(K: Array, forces: Array) -> float:
    """Sum of f.K^-1 f over rows of forces (h, n), which gives soft and stiff coordinates the same weight."""
    return float(np.sum(forces * np.linalg.solve(K, forces.T).T))


def _least_change(A: Array, b: Array) -> Array:
    """Minimum-norm solution of A x = b, rows and columns scaled: equal modes leave the plane of motion free."""
    row_scale, column_scale = np.ones(len(A)), np.ones(len(A))
    for _ in range(3):
        size = np.abs(A * row_scale[:, None] * column_scale)
        row_scale /= np.sqrt(size.max(axis=1))
        column_scale /= np.sqrt(size.max(axis=0))
    scaled = A * row_scale[:, None] * column_scale
    return np.asarray(column_scale * np.linalg.lstsq(scaled, row_scale * b, rcond=SINGULAR)[0])
