"""Closed-form frequencies and static solutions that tests of several element families compare with."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve

from femflex.arrays import Array, IntArray
from femflex.fem import Structure


def static_solution(structure: Structure, force: Array, held: IntArray) -> Array:
    """Displacements (n_dof,) under forces (n_dof,) with the held dofs at rest."""
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    x = np.zeros(structure.n_dof)
    x[free] = spsolve(structure.K[free][:, free].tocsc(), force[free])
    return x


def timoshenko_cantilever(L: float, EI: float, kGA: float, m: float, mr2: float) -> float:
    """First circular frequency of a clamped-free Timoshenko beam: root of the determinant of its transfer matrix."""

    def determinant(omega: float) -> float:
        A = np.array([  # w, theta, M, V along x
            [0, 1, 0, 1 / kGA],
            [0, 0, 1 / EI, 0],
            [0, -mr2 * omega**2, 0, -1],
            [-m * omega**2, 0, 0, 0],
        ])  # fmt: skip
        return float(np.linalg.det(expm(A * L)[2:, 2:]))

    euler = 3.516015 * np.sqrt(EI / m) / L**2
    return float(brentq(determinant, 0.5 * euler, 1.001 * euler))


def mindlin(m: int, n: int, a=10.0, h=1.0, E=200e9, nu=0.3, rho=8000.0) -> float:
    """Frequency [Hz] of m by n half waves of a simply supported square plate: smaller root of Mindlin's equation."""
    k2 = (m * m + n * n) * (np.pi / a) ** 2
    G, D, inertia = 5 / 6 * E / 2 / (1 + nu) * h, E * h**3 / 12 / (1 - nu**2), rho * h**3 / 12
    K = np.array([[G * k2, -G * np.sqrt(k2)], [-G * np.sqrt(k2), G + D * k2]])  # w, and the rotation along the waves
    return float(np.sqrt(np.linalg.eigvals(K / np.array([[rho * h], [inertia]])).real.min()) / (2 * np.pi))
