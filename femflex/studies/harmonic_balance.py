"""Free vibration at finite amplitude, by harmonic balance.

A body with a fixed frame obeys f(q) + Y^T Me (Y q'' + g) = 0 (`fixed_frame_motion`; without dependent shapes Y = 1 and
g = 0).
A motion at rest at t = 0 is even in time, q = sum_k c_k cos(k omega t), and every harmonic must balance:

    (2 - [k = 0]) / T int (f + Y^T Me (Y q'' + g)) cos(k omega t) dt = 0,

with a prescribed displacement of one point at t = 0. The same motion with 1/k of its frequency is a solution as well,
with its k-th harmonic in place of the first: `branch` distinguishes these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.studies.fixed_frame_motion import FixedFrameMotion

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
        return _x(self.harmonics, self.omega)


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
        h, n = c.shape
        waves, projection = _cosine_matrices(h)
        K = self.motion.body.strain.tangent(np.zeros(n))
        for _ in range(STEPS):
            q, q1, q2 = (wave @ c for wave in waves)
            force, inertia = projection @ self.motion.elastic(q), projection @ self.motion.inertia(q, q1, q2)
            residual = force + omega**2 * inertia
            if not np.isfinite(residual).all():
                return None
            amplitude = self.amplitude_and_gradient(c.sum(axis=0))[0]
            amplitude_error = (
                start.amplitude - amplitude if normal_row is None else float(normal_row @ (start.x - _x(c, omega)))
            )
            size = start.amplitude if normal_row is None else 1.0
            if abs(amplitude_error) < CONVERGED * size and _energy(K, residual) < CONVERGED**2 * _energy(K, force):
                return Vibration(start.amplitude if normal_row is None else amplitude, omega, c)
            step = _least_change(self.jacobian(c, omega, normal_row), np.append(-residual.ravel(), amplitude_error))
            c, omega = c + step[:-1].reshape(h, n), omega + float(step[-1])
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
        h, n = c.shape
        waves, projection = _cosine_matrices(h)
        q, q1, q2 = (wave @ c for wave in waves)
        inertia = projection @ self.motion.inertia(q, q1, q2)
        slopes = self.motion.slopes(q, q1, q2, omega**2)
        J = sum(
            np.einsum("kt,tij,tl->kilj", projection, slope, wave, optimize=True)
            for slope, wave in zip(slopes, waves, strict=True)
        ).reshape(h * n, h * n)
        row = self.amplitude_row(c) if last_row is None else last_row
        return np.concatenate([np.column_stack([J, 2 * omega * inertia.reshape(-1, 1)]), row[None]])

    def amplitude_row(self, c: Array) -> Array:
        """Derivative (n_x,) of the amplitude [m] by harmonics c (h, n) and frequency."""
        return np.append(np.tile(self.amplitude_and_gradient(c.sum(axis=0))[1], len(c)), 0.0)

    def rate(self, vibration: Vibration, direction: Array) -> float:
        """Change of the amplitude [m] in a direction (n_x,) over harmonics and frequency."""
        return float(self.amplitude_row(vibration.harmonics) @ direction)

    def amplitude_and_gradient(self, q: Array) -> tuple[float, Array]:
        """The amplitude [m] at coordinates (n,), and its gradient (n,)."""
        return float(self.row @ self.motion.body.amplitudes(q)), self.row @ self.motion.tangent_basis(q[None])[0]


def _x(harmonics: Array, omega: float) -> Array:
    return np.append(harmonics.ravel(), omega)


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
