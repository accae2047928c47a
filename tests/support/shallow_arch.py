"""Free vibrations of a shallow arch by sines and harmonic balance: a second program for its branch and where it folds.

Of a polygon z0(x) on immovable pinned ends, the tension is alike all along (stretch waves are 20 times as fast):

    w = sum q_k sin(k pi x / L),  a_k = int z0' cos(k pi x / L) k pi / L dx
    e = (sum a_k q_k + sum (k pi)^2 q_k^2 / 4 L) / L
    m L / 2 q_k'' + EI (k pi)^4 / 2 L^3 q_k + EA e (a_k + (k pi)^2 q_k / 2 L) = 0
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array

SINES = np.array([1, 3, 5, 7])
HARMONICS, PHASES = 10, 40


@dataclass(frozen=True)
class ShallowArch:
    """Symmetric motions of a polygon of so many elements on a parabola."""

    length: float
    rise: float
    EA: float
    EI: float
    mass: float
    elements: int

    @property
    def slope(self) -> Array:
        """a_k (n,)."""
        x = np.linspace(0.0, self.length, self.elements + 1)
        z = 4 * self.rise * x / self.length * (1 - x / self.length)
        return np.diff(np.sin(np.pi * np.outer(SINES, x) / self.length)) @ (np.diff(z) / np.diff(x))

    def forces(self, q: Array) -> tuple[Array, Array]:
        """Forces (t, n) over inertia m L / 2 at coordinates (t, n), and their slopes (t, n, n)."""
        L, k = self.length, np.pi * SINES
        inertia, bending = self.mass * L / 2, self.EI * k**4 / (2 * L**3)
        turned = self.slope + k**2 * q / (2 * L)
        e = (q @ self.slope + q**2 @ k**2 / (4 * L)) / L
        slopes = self.EA * (turned[:, :, None] * turned[:, None] / L + e[:, None, None] * np.diag(k**2 / (2 * L)))
        return (bending * q + self.EA * e[:, None] * turned) / inertia, (np.diag(bending) + slopes) / inertia

    def branch(self, amplitudes: Sequence[float], most: float, step: float = 0.01) -> Array:
        """Amplitudes at midspan [m] and frequencies [Hz] (points, 2) of the first mode's vibrations.

        First those at given amplitudes, rising, by which thin tongues of other modes are passed over; then along the
        branch in short steps, up to another amplitude or some steps behind a fold.
        """
        n, order = len(SINES), np.arange(HARMONICS)
        phase = 2 * np.pi * np.arange(PHASES) / PHASES
        waves = np.cos(np.outer(phase, order))
        back = waves.T * np.where(order == 0, 1, 2)[:, None] / PHASES
        square, X = np.linalg.eigh(self.forces(np.zeros((1, n)))[1][0])
        unit, omega0 = 1e-3, np.sqrt(square[0])  # amplitudes in mm, frequencies over that at rest
        midspan = np.append(np.tile(np.sin(np.pi * SINES / 2), HARMONICS), 0.0)

        def equations(y: Array) -> tuple[Array, Array]:
            c, ratio = y[:-1].reshape(HARMONICS, n), y[-1]
            force, slopes = self.forces(unit * waves @ c)
            rest = back @ force / (unit * square[0]) - (ratio * order[:, None]) ** 2 * c
            J = np.einsum("kt,tij,tl->kilj", back, slopes / square[0], waves, optimize=True).reshape(len(y) - 1, -1)
            J -= np.diag(np.repeat((ratio * order) ** 2, n))
            return rest.ravel(), np.column_stack([J, (-2 * ratio * order[:, None] ** 2 * c).ravel()])

        def corrected(y: Array, row: Array) -> Array:
            aim = row @ y
            for _ in range(20):
                rest, J = equations(y)
                change = np.linalg.solve(np.vstack([J, row]), np.append(-rest, aim - row @ y))
                y = y + change
                if np.linalg.norm(change) < 1e-10 * np.linalg.norm(y):
                    return y
            raise RuntimeError("the branch was lost")

        last, points = np.eye(HARMONICS * n + 1)[-1], []
        y, tangent = last.copy(), np.zeros_like(last)
        tangent[n : 2 * n] = X[:, 0] / (np.sin(np.pi * SINES / 2) @ X[:, 0])
        for amplitude in amplitudes:
            y = corrected(y + (amplitude / unit - midspan @ y) * tangent, midspan)
            tangent = np.linalg.solve(np.vstack([equations(y)[1], midspan]), last)
            points.append([amplitude, y[-1] * omega0 / (2 * np.pi)])
        while max(points)[0] * 0.99 < points[-1][0] < most:
            tangent = np.linalg.solve(np.vstack([equations(y)[1], tangent]), last)
            tangent /= np.linalg.norm(tangent)
            y = corrected(y + step * np.linalg.norm(y) * tangent, tangent)
            points.append([unit * float(midspan @ y), y[-1] * omega0 / (2 * np.pi)])
        return np.array(points)
