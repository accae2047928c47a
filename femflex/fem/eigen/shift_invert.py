"""(K + shift M)^-1 M: one factorisation, and its largest eigenvalues by Lanczos or densely; modes made unique."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Protocol

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigsh, splu

from femflex.arrays import Array
from femflex.fem.eigen.multifrontal import Cholesky, worthwhile

Solve = Callable[[Array], Array]

DENSE_DOFS = 500  # up to this, a dense solution costs less than one factorisation and its Lanczos steps
SPREAD = 1e4  # ratio of dense eigenvalues above which the smaller ones are solved for again
NO_MASS = 1e-14  # relative inverse eigenvalue below which a mode is numerically massless


class Factors(Protocol):
    """Factors of a matrix A (n, n)."""

    def solve(self, b: Array, /) -> Array:
        """A^-1 b of b (n,) or (n, k), in the unit of b over that of A: [m] of forces and stiffness."""


def factorise(A: sparse.csr_array) -> Factors:
    """Sparse factors of a symmetric positive matrix (n, n) in any unit.

    Large solids are factorised by dense fronts, others and matrices that are not positive definite by SuperLU with
    pivots on the diagonal.
    """
    if worthwhile(A):
        try:
            return Cholesky(A)
        except np.linalg.LinAlgError:
            pass
    return splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def orthonormalise(M: sparse.csr_array, phi: Array) -> Array:
    """Columns of phi (n_dof, n) [m, rad] made M-orthonormal in their order (Gram–Schmidt by two Cholesky steps)."""
    phi = phi / np.sqrt(np.einsum("in,in->n", phi, M @ phi))
    for _ in range(2):
        L = np.linalg.cholesky(phi.T @ (M @ phi))
        phi = linalg.solve_triangular(L, phi.T, lower=True).T
    return phi


def dense_modes(K: Array, M: Array) -> tuple[Array, Array]:
    """Eigenvalues omega^2 (m,) ascending and M-orthonormal modes (n, m) of small dense matrices.

    Massless modes are left out. Both ends of the spectrum are accurate. K or M must be positive definite.
    """
    if not len(K):
        return np.zeros(0), np.zeros((0, 0))
    try:
        theta, phi = _inverse_modes(K, M, len(K))
    except SingularError:
        return linalg.eigh(K, M)
    return 1 / theta, phi / np.sqrt(np.einsum("in,in->n", phi, M @ phi))


def _inverse_modes(A: Array, M: Array, count: int) -> tuple[Array, Array]:
    """The count largest theta of M x = theta A x and their shapes, descending, fewer when fewer carry mass.

    Smaller theta have the rounding error of the largest; where they differ much, the smaller ones are solved for again.
    """
    try:
        theta, phi = linalg.eigh(M, A, subset_by_index=[len(A) - count, len(A) - 1])
    except np.linalg.LinAlgError as error:
        raise SingularError from error
    massive = theta > NO_MASS * theta[-1]
    theta, phi = theta[massive][::-1], phi[:, massive][:, ::-1]
    if not theta.size or theta[0] < SPREAD * theta[-1]:
        return theta, phi
    small = theta < np.sqrt(theta[0] * theta[-1])
    rest = phi[:, small] / np.sqrt(theta[small])
    values, X = linalg.eigh(rest.T @ (A @ rest), rest.T @ (M @ rest))
    return np.append(theta[~small], 1 / values), np.column_stack([phi[:, ~small], rest @ X])


class SingularError(Exception):
    """The shifted stiffness has no factors."""


class ShiftInverted:
    """(K + shift M)^-1 M, factorised once, and its largest eigenvalues theta = 1 / (omega^2 + shift).

    solve: b -> (K + shift M)^-1 b, if factors exist already; not used when the problem is solved densely.
    """

    def __init__(self, K: sparse.csr_array, M: sparse.csr_array, shift: float, solve: Solve | None = None) -> None:
        self._M, self._A = M, (K + shift * M if shift else K)
        self._n = K.shape[0]
        self.solve: Solve | None = None
        if self._n > DENSE_DOFS:
            try:
                self.solve = solve or factorise(self._A).solve
            except RuntimeError as error:
                raise SingularError from error

    def largest(self, count: int, surely: int = 0, tolerance: float = 0.0) -> tuple[Array, Array]:
        """The largest theta (count,) [s^2/rad^2] by size, and their shapes (n_dof, count), fewer when fewer dofs
        carry mass.

        surely: how many of them must be the largest, none missed. tolerance: relative, of the Lanczos search.
        """
        if self.solve is None or count > self._n // 4:
            theta, phi = _inverse_modes(self._A.toarray(), self._M.toarray(), count)
        else:
            theta, phi = self._eigsh(count, self.solve, seed=0, tolerance=tolerance)
            theta, phi = self.with_missed_copies(theta, phi, surely)
        keep = np.abs(theta) > NO_MASS * np.abs(theta).max()
        return theta[keep], phi[:, keep]

    def with_missed_copies(self, theta: Array, phi: Array, surely: int) -> tuple[Array, Array]:
        """Return theta (k,) [s^2/rad^2] and phi (n_dof, k) with copies of repeated frequencies that Lanczos from one
        vector may miss.

        A second search, M-orthogonal to all that was found, must not find anything among the first `surely`.
        """
        solve = self.solve
        while surely and solve is not None:
            phi = orthonormalise(self._M, phi)
            basis, M_basis = np.asfortranarray(phi), np.asfortranarray(self._M @ phi)

            def deflated_solve(
                load: Array, basis: Array = basis, M_basis: Array = M_basis, solve: Solve = solve
            ) -> Array:
                x = solve(load - M_basis @ (basis.T @ load))
                return x - basis @ (M_basis.T @ x)

            last = np.sort(np.abs(theta))[::-1][min(surely, len(theta)) - 1]
            top, shape = self._eigsh(1, deflated_solve, seed=1, tolerance=0.05)
            if np.abs(top[0]) > 0.95 * last:
                top, shape = self._eigsh(1, deflated_solve, seed=1, tolerance=0.0)
            if np.abs(top[0]) <= (1 + CLOSE) * last:
                break
            theta, phi = np.append(theta, top), np.column_stack([phi, shape])
        return theta, phi

    def _eigsh(self, count: int, solve: Solve, seed: int, tolerance: float) -> tuple[Array, Array]:
        operator = LinearOperator((self._n, self._n), matvec=solve, dtype=float)
        start = solve(self._M @ np.random.default_rng(seed).standard_normal(self._n))
        try:
            values, phi = eigsh(self._A, count, self._M, sigma=0.0, OPinv=operator, v0=start, tol=tolerance)
        except ArpackNoConvergence as error:
            raise RuntimeError(
                f"the {count} lowest modes did not converge in {self._n} degrees of freedom; "
                "check for weakly connected parts and for stiffnesses many orders apart, or request fewer modes."
            ) from error
        except ArpackError as error:
            mass = self._M.diagonal()
            raise RuntimeError(
                f"the eigen-solver found no {count} lowest modes in {self._n} degrees of freedom: their masses go from "
                f"{mass[mass > 0].min(initial=np.inf):.3g} to {mass.max():.3g} (kg, kg m^2); check densities, sections "
                "and units for values many orders apart"
            ) from error
        order = np.argsort(np.abs(values), kind="stable")
        return 1.0 / values[order], phi[:, order]


# A unique choice among the many equivalent sets of modes: order, sign, and the basis inside a degenerate cluster.
#
# An eigen-solver returns a mode up to its sign and a repeated frequency up to any rotation of its shapes; which one
# depends on rounding. The rules here depend only on the span of the shapes, so that a run is repeatable on any machine.


CLOSE = 1e-3  # relative gap of natural frequencies below which a truncation must not separate them
DEGENERATE = 1e-8  # relative gap of eigenvalues below which the shapes are any basis of their span
TIE = 1e-6  # relative difference below which two entries count as equally large; the first wins


def canonical_modes(eigenvalues: Array, phi: Array) -> Array:
    """Return the modes phi (n_dof, n) with a fixed basis in each degenerate cluster and fixed signs.

    eigenvalues (n,) ascend. Inside a cluster the basis is the pivoted echelon form: the row of largest norm (which no
    rotation changes) is rotated into the first shape only, then the largest of the rest into the second, and so on.
    """
    phi = phi.copy()
    for cluster in clusters(eigenvalues, DEGENERATE):
        if cluster.stop - cluster.start > 1:
            phi[:, cluster] = _echelon(phi[:, cluster])
    return phi * signs(phi)


def clusters(eigenvalues: Array, gap: float) -> list[slice]:
    """Runs of ascending eigenvalues (n,), in any unit, whose neighbours differ by less than a relative gap."""
    scale = np.maximum(np.abs(eigenvalues[1:]), np.abs(eigenvalues[:-1]))
    breaks = np.flatnonzero(np.diff(eigenvalues) > gap * scale) + 1
    edges = [0, *breaks.tolist(), len(eigenvalues)]
    return [slice(a, b) for a, b in pairwise(edges) if b > a]


def count_without_split_cluster(omega: Array, n: int) -> int | None:
    """Return the smallest count m >= n that splits no close pair m, m + 1; None when omega (k,) is too short to
    decide."""
    for m in range(n, len(omega)):
        if omega[m] - omega[m - 1] > CLOSE * omega[m]:
            return m
    return None


def signs(phi: Array) -> Array:
    """Sign (n,) [1] of each column's largest entry; among entries that tie, the first."""
    size = np.abs(phi)
    largest = np.argmax(size >= (1 - TIE) * size.max(axis=0), axis=0)
    return np.where(phi[largest, np.arange(phi.shape[1])] < 0, -1.0, 1.0)


def _echelon(phi: Array) -> Array:
    """Columns of phi rotated so that each pivot row is zero in the columns after its own."""
    rotation = np.eye(phi.shape[1])
    for j in range(phi.shape[1] - 1):
        rest = phi @ rotation[:, j:]
        norms = np.linalg.norm(rest, axis=1)
        pivot = rest[int(np.argmax(norms >= (1 - TIE) * norms.max()))]
        # an orthogonal matrix whose first column is along the pivot row
        Q, _ = np.linalg.qr(np.column_stack([pivot, np.eye(len(pivot))]))
        rotation[:, j:] = rotation[:, j:] @ Q
    return phi @ rotation
