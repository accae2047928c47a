"""Ritz's method for a plate that stays flat in its spin: no finite elements, no reduction, none of femflex."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import Legendre, leggauss
from scipy import linalg

from support.full_spin import skew


class Polynomials:
    """x^power P_i(x) P_j(y), i, j < n, on a plate of unit length at Gauss points x, y (p,)."""

    def __init__(self, width, n):
        s, weight = leggauss(n + 6)
        self.x, self.y = (grid.ravel() for grid in np.meshgrid((s + 1) / 2, s * width / 2, indexing="ij"))
        self.weight = np.outer(weight, weight).ravel() * width / 4
        self.domains, self.n = ([0.0, 1.0], [-width / 2, width / 2]), n

    def __call__(self, power, dx=0, dy=0):
        """Their derivatives (p, n^2)."""
        along, across = ([Legendre.basis(k, domain) for k in range(self.n)] for domain in self.domains)
        root = Legendre.identity(self.domains[0]) ** power
        first = np.stack([(root * P).deriv(dx)(self.x) for P in along])
        second = np.stack([P.deriv(dy)(self.y) for P in across])
        return np.einsum("ip,jp->pij", first, second).reshape(len(self.x), -1)


def ritz_frequencies(plate, gamma, count, n=10):
    """The lowest frequencies of a SpinningPlate at a setting of 0 or 90 degrees.

    Fields (u, v, w) = (x, x, x^2) times polynomials. First the plane stress N of the spin, then small motions about it:
    bending, N over the slopes, and the inertia forces of two layers at +- h / sqrt 12 in the spinning frame.
    """
    f = Polynomials(plate.width, n)
    z, nu, h = np.zeros((len(f.x), n * n)), plate.nu, plate.thickness
    C = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    strain = np.stack([np.hstack(r) for r in ((f(1, 1), z, z), (z, f(1, 0, 1), z), (f(1, 0, 1), f(1, 1), z))], axis=1)
    bend = np.stack([np.hstack([z, z, k]) for k in (f(2, 2), f(2, 0, 2), 2 * f(2, 1, 1))], axis=1)
    slope = np.stack([np.hstack([z, z, k]) for k in (f(2, 1), f(2, 0, 1))], axis=1)
    K = np.einsum("psi,st,ptj,p->ij", bend, C, bend, f.weight, optimize=True)
    K += 12 / h**2 * np.einsum("psi,st,ptj,p->ij", strain, C, strain, f.weight, optimize=True)
    M, G, S, s = _inertia(plate, f, slope)
    plane = np.arange(2 * n * n)
    x = np.linalg.solve((K + gamma**2 * S)[np.ix_(plane, plane)], -(gamma**2) * s[plane])
    N = 12 / h**2 * np.einsum("st,pti,i->ps", C, strain[:, :, plane], x)
    stress = np.stack([N[:, [0, 2]], N[:, [2, 1]]], axis=1)
    K = K + gamma**2 * S + np.einsum("psi,pst,ptj,p->ij", slope, stress, slope, f.weight, optimize=True)
    size = len(K)
    A = np.block([[np.zeros((size, size)), np.eye(size)], [-K, -2 * gamma * G]])
    found = linalg.eigvals(A, linalg.block_diag(np.eye(size), M)).imag
    return np.sort(found[found > 1e-6])[:count]


def _inertia(plate, f, slope):
    """M, C, S (n, n) and s (n,) as in full_spin, of two layers of half the mass."""
    E, z = skew(plate.axis), np.zeros_like(f(0))
    total = [0.0, 0.0, 0.0, 0.0]
    for height in plate.thickness / np.sqrt(12) * np.array([1, -1]):
        rows = np.stack([np.hstack(r) for r in ((f(1), z, z), (z, f(1), z), (z, z, f(2)))], axis=1)
        rows[:, :2] -= height * slope
        rho = np.column_stack([plate.hub + f.x, f.y, np.full_like(f.x, height)])
        pushed = np.einsum("pai,p->pai", rows, f.weight / 2)
        tables = [np.einsum("pai,ab,pbj->ij", pushed, A, rows, optimize=True) for A in (np.eye(3), E, E @ E)]
        tables.append(np.einsum("pai,ab,pb->i", pushed, E @ E, rho))
        total = [a + b for a, b in zip(total, tables, strict=True)]
    return total
