"""Small motions about a state of rest in the base frame: one eigenvalue and one complex shape for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.equilibria.linearised import Linearised

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

GROWING = 1e-4  # real part over size above which an eigenvalue is taken to grow


@dataclass(frozen=True, eq=False)
class Vibrations:
    """Motions shape exp(eigenvalue t) of the linear equations, by rising frequency.

    eigenvalues (n,)        [1/s]: of a conjugate pair the one above the real axis; of two real ones that belong
                            together (both directions of a buckling, both rates of an overdamped motion) the larger
    shapes      (n_free, n) increments of the free coordinates, of mass 1: conj(shape) . M shape
    M           (n_free, n_free) mass matrix
    """

    eigenvalues: Complex
    shapes: Complex
    M: Array

    @property
    def frequencies(self) -> Array:
        """(n,) [Hz], 0 for a motion that does not swing."""
        return np.asarray(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """(n,) -Re / |eigenvalue|: below 0 grows, 1 and -1 do not swing."""
        size = np.abs(self.eigenvalues)
        return np.asarray(-self.eigenvalues.real / np.where(size > 0, size, 1.0))

    @property
    def growing(self) -> NDArray[np.bool_]:
        """(n,) which motions grow."""
        return np.asarray(self.eigenvalues.real > GROWING * np.abs(self.eigenvalues))


def vibrations(linear: Linearised, neutral: int = 0) -> Vibrations:
    """The small motions of linear equations, but for those along so many neutral coordinates."""
    n = len(linear.M)
    values, columns = np.linalg.eig(linear.state_matrix())
    order = np.argsort(np.abs(values), kind="stable")[2 * neutral :]
    values, columns = values[order], columns[:, order]
    swinging = np.flatnonzero(values.imag > 0)
    real = np.flatnonzero(values.imag == 0)
    real = real[np.argsort(-values[real].real, kind="stable")][: len(real) // 2]
    chosen = np.concatenate([swinging, real])
    chosen = chosen[np.lexsort((-values[chosen].real, values[chosen].imag))]
    shapes = np.asarray(columns[:n, chosen], complex)
    mass = np.einsum("ik,ij,jk->k", shapes.conj(), linear.M, shapes).real
    return Vibrations(np.asarray(values[chosen], complex), shapes / np.sqrt(np.maximum(mass, 1e-300)), linear.M)
