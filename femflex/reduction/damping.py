"""Elastic damping of a reduced body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femflex.fem.eigen.modes import dense_modes

Array = NDArray[np.float64]


class Damping(Protocol):
    """What gives a damping matrix from elastic mass and stiffness."""

    def matrix(self, Me: Array, V1: Array) -> Array:
        """Damping matrix (n, n)."""


def bending_damping(damping: Damping, Me: Array, V1: Array, damped: ArrayLike) -> Array:
    """Damping matrix (n, n) on the shapes `damped` (n,) alone.

    With nonlinear strain the others take back the stretch of bending: they move without being strained, in step with
    the square of the deflection. A fraction of the critical damping of so stiff a shape would then damp bending itself,
    and by far more than the same fraction of bending's own (a panel of 0.6 Hz bent by a tenth of its length: 14 times).
    """
    at = np.flatnonzero(damped)
    D = np.zeros_like(V1)
    D[np.ix_(at, at)] = damping.matrix(Me[np.ix_(at, at)], V1[np.ix_(at, at)])
    return D


@dataclass(frozen=True, eq=False)
class ModalDamping:
    """Fraction of critical damping of every mode of the reduced body: one number, or one per mode, ascending.

    With nonlinear strain the modes are those without derivative shapes (`bending_damping`).
    D = Me X diag(2 zeta omega) X^T Me with the body's own modes V1 X = Me X diag(omega^2).
    """

    ratio: ArrayLike

    def __post_init__(self) -> None:
        ratio = np.asarray(self.ratio, float)
        if not (np.isfinite(ratio).all() and (ratio >= 0).all()):
            raise ValueError(
                f"damping ratio is {ratio.tolist()}; it must be zero or positive, and finite (0.005 is half a percent)."
            )

    def matrix(self, Me: Array, V1: Array) -> Array:
        """See Damping. Raises ValueError when there is neither one ratio nor one per mode."""
        n = len(Me)
        ratio: Array = np.asarray(self.ratio, float)
        if ratio.ndim and ratio.shape != (n,):
            raise ValueError(f"{ratio.size} damping ratios were given for {n} modes; give one, or one per mode.")
        if not n or not np.any(ratio):
            return np.zeros((n, n))
        eigenvalues, X = dense_modes(V1, Me)
        MX = Me @ X
        D = (MX * (2 * ratio * np.sqrt(np.maximum(eigenvalues, 0.0)))) @ MX.T
        return (D + D.T) / 2


@dataclass(frozen=True)
class RayleighDamping:
    """Damping in proportion to mass and stiffness, D = alpha Me + beta V1 (alpha [1/s], beta [s])."""

    alpha: float = 0.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite([self.alpha, self.beta]).all() and self.alpha >= 0 and self.beta >= 0):
            raise ValueError(
                f"Rayleigh damping has alpha = {self.alpha}, beta = {self.beta}; both must be zero or positive."
            )

    def matrix(self, Me: Array, V1: Array) -> Array:
        """See Damping."""
        return self.alpha * Me + self.beta * V1
