"""Free vibration at finite amplitude, by harmonic balance.

A body whose frame is held moves by f(q) + Y^T Me (Y q'' + g) = 0 (`held_motion`; Y = 1 and g = 0 unless shapes follow).
A motion at rest at t = 0 is even in time, q = sum_k c_k cos(k omega t), and every harmonic must balance:

    (2 - [k = 0]) / T int (f + Y^T Me (Y q'' + g)) cos(k omega t) dt = 0,

with the displacement of one place at t = 0 given. The same motion, called k times as slow, balances as well, its k-th
harmonic in the place of the first: `branch` tells these apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.studies.held_motion import HeldMotion

STEPS = 12  # of Newton's method, which starts near by
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
    """The equations of a body's motion, and the row over all shapes that tells its amplitude."""

    motion: HeldMotion
    row: Array

    def balanced(self, start: Vibration, along: Array | None = None) -> Vibration | None:
        """The motion near a start that has its amplitude; None if none is found.

        along: row (n_x,) [1/(kg^1/2 m), s/rad] over harmonics and frequency; the motion sought differs from the start
        across it instead.
        """
        c, omega = start.harmonics, start.omega
        h, n = c.shape
        waves, back = _waves(h)
        K = self.motion.body.strain.tangent(np.zeros(n))
        for _ in range(STEPS):
            q, q1, q2 = (wave @ c for wave in waves)
            force, inertia = back @ self.motion.elastic(q), back @ self.motion.inertia(q, q1, q2)
            rest = force + omega**2 * inertia
            if not np.isfinite(rest).all():
                return None
            reached = self.reached(c.sum(axis=0))[0]
            miss = start.amplitude - reached if along is None else float(along @ (start.x - _x(c, omega)))
            size = start.amplitude if along is None else 1.0
            if abs(miss) < CONVERGED * size and _energy(K, rest) < CONVERGED**2 * _energy(K, force):
                return Vibration(start.amplitude if along is None else reached, omega, c)
            step = _least_change(self.jacobian(c, omega, along), np.append(-rest.ravel(), miss))
            c, omega = c + step[:-1].reshape(h, n), omega + float(step[-1])
        return None

    def tangent(self, at: Vibration, row: Array | None = None) -> Array:
        """Direction (n_x,) [kg^1/2 m, rad/s] over harmonics and frequency in which motions go on: 1 along a row, or per
        amplitude."""
        right = np.append(np.zeros(at.harmonics.size), 1.0)
        return _least_change(self.jacobian(at.harmonics, at.omega, row), right)

    def jacobian(self, c: Array, omega: float, last: Array | None = None) -> Array:
        """Derivatives (n_x, n_x) [SI] of the unbalanced forces by harmonics and frequency, and a last row.

        Left out, that is the derivative of the amplitude.
        """
        h, n = c.shape
        waves, back = _waves(h)
        q, q1, q2 = (wave @ c for wave in waves)
        inertia = back @ self.motion.inertia(q, q1, q2)
        slopes = self.motion.slopes(q, q1, q2, omega**2)
        J = sum(
            np.einsum("kt,tij,tl->kilj", back, slope, wave, optimize=True)
            for slope, wave in zip(slopes, waves, strict=True)
        ).reshape(h * n, h * n)
        row = self.amplitude_row(c) if last is None else last
        return np.concatenate([np.column_stack([J, 2 * omega * inertia.reshape(-1, 1)]), row[None]])

    def amplitude_row(self, c: Array) -> Array:
        """Derivative (n_x,) of the amplitude [m] by harmonics c (h, n) and frequency."""
        return np.append(np.tile(self.reached(c.sum(axis=0))[1], len(c)), 0.0)

    def rate(self, at: Vibration, along: Array) -> float:
        """Change of the amplitude [m] in a direction (n_x,) over harmonics and frequency."""
        return float(self.amplitude_row(at.harmonics) @ along)

    def reached(self, q: Array) -> tuple[float, Array]:
        """The amplitude [m] at coordinates (n,), and its gradient (n,)."""
        return float(self.row @ self.motion.body.amplitudes(q)), self.row @ self.motion.ties(q[None])[0]


def _x(harmonics: Array, omega: float) -> Array:
    return np.append(harmonics.ravel(), omega)


def _waves(h: int) -> tuple[tuple[Array, Array, Array], Array]:
    """Cosines of h harmonics with their first two derivatives by phase (t, h), and what picks harmonics out (h, t)."""
    phase = 2 * np.pi * np.arange(4 * h) / (4 * h)  # products of four harmonics below h are distinguished
    order = np.arange(h)
    cosine, sine = np.cos(np.outer(phase, order)), np.sin(np.outer(phase, order))
    back = cosine.T * np.where(order == 0, 1.0, 2.0)[:, None] / len(phase)
    return (cosine, -order * sine, -(order**2) * cosine), back


def _energy(K: Array, forces: Array) -> float:
    """Sum of f.K^-1 f over rows of forces (h, n): weighs soft and stiff coordinates alike."""
    return float(np.sum(forces * np.linalg.solve(K, forces.T).T))


def _least_change(A: Array, b: Array) -> Array:
    """Least solution of A x = b, rows and columns scaled: modes alike leave the plane of their motion open."""
    left, right = np.ones(len(A)), np.ones(len(A))
    for _ in range(3):
        size = np.abs(A * left[:, None] * right)
        left /= np.sqrt(size.max(axis=1))
        right /= np.sqrt(size.max(axis=0))
    scaled = A * left[:, None] * right
    return np.asarray(right * np.linalg.lstsq(scaled, left * b, rcond=SINGULAR)[0])
