"""Strain tensors: the elastic energy of a body as a polynomial in its coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body.symmetric import form, gradient, hessian, packed_size, truncated

SETTLING, HALVINGS = 50, 30  # steps of Newton's method, and how often one of them is halved at most


@dataclass(frozen=True, eq=False)
class StrainTensors:
    """Strain tensors of eq. (7), with the factor 1/2: V = f0.d + 1/2 [V1 dd + 2 V2 ddd + V3 dddd].

    V1  (n, n)          int B0^T C B0 + 2 int sigma0.B        [1/s^2 for mass-normalised shapes]
    f0  (n,)            int sigma0.B0                         [kg^1/2 m / s^2]
    V2  (C(n+2, 3),)    symmetric part of int B0^T C B        [kg^-1/2 m^-1 / s^2]
    V3  (C(n+3, 4),)    symmetric part of int B^T C B         [kg^-1 m^-2 / s^2]

    V2 and V3 are packed over i <= j <= k (<= l) in lexicographic order (`femflex.body.symmetric`); both are empty for
    linear strain.
    """

    V1: Array
    f0: Array
    V2: Array = field(default_factory=lambda: np.zeros(0))
    V3: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        n = self.V1.shape[0]
        sizes = {"V2": (self.V2.shape, packed_size(n, 3)), "V3": (self.V3.shape, packed_size(n, 4))}
        for name, (shape, size) in sizes.items():
            if shape not in ((0,), (size,)):
                raise ValueError(
                    f"strain tensor {name} of {n} coordinates has {size} packed values, or none where strain is "
                    f"linear; found shape {shape}"
                )

    @classmethod
    def linear(cls, V1: Array) -> StrainTensors:
        """Strain tensors of an unstressed body with stiffness V1 (n, n)."""
        V1 = np.asarray(V1, float)
        return cls(V1, np.zeros(V1.shape[0]))

    @property
    def is_linear(self) -> bool:
        """Whether the elastic force is linear in the coordinates: V2 and V3 are empty or zero."""
        return not (self.V2.any() or self.V3.any())

    def energy(self, d: Array) -> float:
        """Strain energy V at d (n,) [J], zero at d = 0."""
        d = np.asarray(d, float)
        cubic = form(self.V2, d, 3) if self.V2.size else 0.0
        quartic = form(self.V3, d, 4) if self.V3.size else 0.0
        return float(self.f0 @ d + (d @ self.V1 @ d + 2 * cubic + quartic) / 2)

    def force(self, d: Array) -> Array:
        """Elastic force dV/dd = f0 + V1 d + 3 V2 dd + 2 V3 ddd at d (n,): (n,)."""
        d = np.asarray(d, float)
        out = self.f0 + (self.V1 + self.V1.T) @ d / 2
        if self.V2.size:
            out = out + gradient(self.V2, d, 3)
        return out + gradient(self.V3, d, 4) / 2 if self.V3.size else out

    def tangent(self, d: Array) -> Array:
        """Tangent stiffness V1 + 6 V2 d + 6 V3 dd at d (n,): (n, n)."""
        d = np.asarray(d, float)
        out = (self.V1 + self.V1.T) / 2
        if self.V2.size:
            out = out + hessian(self.V2, d, 3)
        return out + hessian(self.V3, d, 4) / 2 if self.V3.size else out

    def settled(self, d: Array, free: NDArray[np.intp]) -> Array:
        """State near d (n,) in which the coordinates numbered `free` minimise the energy; the others keep their values.

        Newton's method on the energy, with steps shortened until it falls.
        """
        d = np.array(d, float)
        for _ in range(SETTLING if len(free) else 0):
            step = np.asarray(
                np.linalg.lstsq(self.tangent(d)[np.ix_(free, free)], -self.force(d)[free], rcond=1e-14)[0], float
            )
            trials = (_stepped(d, free, 0.5**k * step) for k in range(HALVINGS))
            lower = next((trial for trial in trials if self.energy(trial) < self.energy(d)), None)
            if lower is None:  # at rounding
                return d
            d = lower
        return d

    def truncated(self, n: int) -> StrainTensors:
        """The tensors of the first n coordinates alone."""
        n_old = self.V1.shape[0]
        V2 = truncated(self.V2, n_old, n, 3) if self.V2.size else self.V2
        V3 = truncated(self.V3, n_old, n, 4) if self.V3.size else self.V3
        return StrainTensors(self.V1[:n, :n], self.f0[:n], V2, V3)


def _stepped(d: Array, coordinates: NDArray[np.intp], step: Array) -> Array:
    out = d.copy()
    out[coordinates] += step
    return out
