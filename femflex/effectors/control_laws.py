"""Laws of controllers: the matrices of linear ones, and what sampled ones do at their instants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.system.evaluation import CHANNEL_FOLDER

OFF = 1e-9  # part of a period below which a pulse is none


class LinearLaw(NamedTuple):
    """dx/dt = A x + B u, y = C x + D u: A (n, n), B (n, m), C (p, n), D (p, m)."""

    A: Array
    B: Array
    C: Array
    D: Array

    @classmethod
    def from_matrices(cls, A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike) -> LinearLaw:
        """The law of these matrices. Raises ValueError for sizes that do not fit."""
        matrices = tuple(np.array(matrix, float) for matrix in (A, B, C, D))
        n, (p, m) = len(matrices[0]), matrices[3].shape
        for key, matrix, shape in zip("ABC", matrices, ((n, n), (n, m), (p, n)), strict=False):
            if matrix.shape != shape:
                raise ValueError(
                    f"{key} of a block has shape {matrix.shape}; with D of shape {(p, m)} it needs {shape}"
                )
        return cls(*matrices)

    @classmethod
    def gain(cls, K: ArrayLike) -> LinearLaw:
        """y = K u."""
        D = np.array(K, float)
        return cls(np.zeros((0, 0)), np.zeros((0, D.shape[1])), np.zeros((D.shape[0], 0)), D)

    def repeated(self, channels: int) -> LinearLaw:
        """This law for each of several inputs."""
        return LinearLaw(*(np.asarray(np.kron(np.eye(channels), matrix), float) for matrix in self))


def discretised(law: LinearLaw, period: float) -> LinearLaw:
    """Return x_(k+1) = A x_k + B u_k for inputs constant over each period [s]: exp([[A, B], [0, 0]] period)."""
    from scipy.linalg import expm

    A, B, C, D = law
    n, m = B.shape
    if not n:
        return law
    exponential = np.asarray(expm(np.block([[A, B], [np.zeros((m, n + m))]]) * period), float)
    return LinearLaw(exponential[:n, :n], exponential[:n, n:], C, D)


def paths_of(signals: Sequence[str]) -> tuple[str, ...]:
    """Return the channels of the result file for these signals."""
    return tuple(CHANNEL_FOLDER + "/".join(signal.rpartition(".")[::2]) for signal in signals)


@dataclass(frozen=True, eq=False)
class SampledLaw:
    """A sampled linear controller; memory is x. With states its matrices are those of x_(k+1) = A x_k + B u_k."""

    law: LinearLaw
    limits: Array
    scaled: bool
    paths: tuple[str, ...]

    def __call__(self, t: float, sensors: Mapping[str, Array], memory: Array) -> tuple[Array, Array]:
        A, B, C, D = self.law
        u = np.array([float(sensors[path]) for path in self.paths])
        y = C @ memory + D @ u
        if self.scaled:
            y = y * min(1.0, float(np.min(self.limits / np.maximum(np.abs(y), 1e-300))))
        return np.clip(y, -self.limits, self.limits), A @ memory + B @ u if len(A) else memory


@dataclass(frozen=True, eq=False)
class SampledAttitude:
    """The law of sampled quaternion feedback."""

    P: Array
    D: Array
    J: Array
    limit: float
    paths: tuple[str, ...]

    def __call__(self, t: float, sensors: Mapping[str, Array], memory: Array) -> tuple[Array, Array]:
        u = np.array([float(sensors[path]) for path in self.paths])
        e, omega, H = u[:3], u[3:6], u[6:] if len(u) > 6 else np.zeros(3)
        torque = -self.P @ e - self.D @ omega + np.cross(omega, self.J @ omega + H)
        return np.clip(torque, -self.limit, self.limit), memory


@dataclass(frozen=True, eq=False)
class PulseWidths:
    """The law of pulse-width modulation. Memory: when each thruster goes off, and when the next period begins."""

    paths: tuple[str, ...]
    full: Array
    period: float
    minimum_on: float

    def __call__(self, t: float, sensors: Mapping[str, Array], memory: Array) -> tuple[Array, Array, float | None]:
        off, due = memory[:-1], memory[-1]
        if t >= due - OFF * self.period:
            due = t + self.period
            demand = np.array([float(sensors[path]) for path in self.paths])
            width = np.clip(demand / self.full, 0.0, 1.0) * self.period
            width[width < max(self.minimum_on, OFF * self.period)] = 0.0
            off = np.where(width >= self.period * (1.0 - OFF), np.inf, t + width)
        on = off > t * (1.0 + 1e-15) + 1e-300
        later = off[on & (off < due - OFF * self.period)]
        return (
            on.astype(float),
            np.concatenate([np.where(np.isinf(off), 1e300, off), [due]]),
            float(later.min()) if later.size else None,
        )
