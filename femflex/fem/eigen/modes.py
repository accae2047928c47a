"""Lowest modes of (K, M) by shift-invert, sorted into shapes without stiffness and elastic modes.

K phi = omega^2 M phi with K and M symmetric, M semi-definite (massless dofs are allowed). The operator is
(K + shift M)^-1 M; its largest eigenvalues 1 / (omega^2 + shift) are found by Lanczos, or densely for small problems.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.eigen.shift_invert import (
    DENSE_DOFS,
    ShiftInverted,
    SingularError,
    Solve,
    canonical_modes,
    count_without_split_cluster,
    factorise,
    orthonormalise,
)
from femflex.warning import warn_of_physics

NO_STIFFNESS = 1e-15  # strain energy over the size of its summands; rounding leaves about 1e-17 of a rigid motion
NO_ENERGY = 1e-21  # eigenvalue over a dof's own below which a shape lies in dofs that have no stiffness at all
FEW_DIGITS = 1e-14  # ratio as for NO_STIFFNESS below which rounding of K may reach a hundredth of a natural frequency
RESIDUAL = 1e-9  # |K phi - omega^2 M phi| over the size of its summands, or else in energy

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest elastic modes of a structure and its shapes without stiffness.

    omega (n,)         natural frequencies, ascending [rad/s]
    phi   (n_dof, n)   M-orthonormal shapes, largest entry positive
    null  (n_dof, r)   M-orthonormal basis of rigid motions and mechanisms (no strain energy)
    note  str          the reason when more modes than requested are kept; else empty
    """

    omega: Array
    phi: Array
    null: Array
    note: str = ""


class IdleError(ValueError):
    """Some motions have neither stiffness nor mass. dofs (k,): numbers of those with zeros on both diagonals."""

    def __init__(self, dofs: IntArray, places: str = "") -> None:
        self.dofs = dofs
        super().__init__(
            f"some motions have neither stiffness nor mass ({len(dofs)} degrees of freedom by themselves{places}); "
            "give every member both, and leave one of the elements that meet at a node without a release."
        )


def lowest_modes(
    K: sparse.csr_array, M: sparse.csr_array, n: int, free: bool = False, solve: Solve | None = None
) -> Modes:
    """Return the n lowest elastic modes of (K [N/m], M [kg]), (n_dof, n_dof), or a few more where n would split a close
    pair.

    free: whether K is known to be singular, so that it is not factorised in vain.
    solve: b -> K^-1 b by existing factors, with b and the result M-orthogonal to the motions without stiffness.
    Raises ValueError when n is not positive, or exceeds the dofs that carry mass.
    """
    n_dof = K.shape[0]
    if n_dof and not M.diagonal().any():
        raise ValueError(
            "modes were requested of a structure without mass; give its materials a density, or point masses."
        )
    if n <= 0:
        raise ValueError(f"{n} modes were requested; request at least one.")
    if n > n_dof:
        raise ValueError(
            f"{n} modes were requested, but only {n_dof} degrees of freedom are free to move; request at most {n_dof}."
        )
    if not free or (solve is not None and n_dof > DENSE_DOFS):
        try:
            modes = _elastic_modes(K, M, n, n_null=0, shift=0.0, solve=solve)
            if modes.null.shape[1] == 0:
                return modes
        except SingularError:
            pass
    n_null, shift = _null_count(K, M)
    if n > n_dof - n_null:
        raise ValueError(
            f"{n} modes were requested, but of the {n_dof} degrees of freedom {n_null} are motions without stiffness; "
            f"request at most {n_dof - n_null}."
        )
    try:
        return _elastic_modes(K, M, n, n_null, shift)
    except SingularError:
        raise _indefinite_error(K) from None


def _indefinite_error(K: sparse.csr_array) -> ValueError:
    """The error of a stiffness matrix with negative eigenvalues, with the largest and least entry of its diagonal."""
    diagonal = K.diagonal()
    return ValueError(
        "the stiffness matrix is not positive definite within rounding: its diagonal goes from "
        f"{diagonal.min():.3g} to {diagonal.max():.3g}. Some stiffnesses are negative, or lie too many orders apart; "
        "check stiff springs, rods and short bars."
    )


def stiffness_ratio(K: sparse.csr_array, phi: Array) -> Array:
    """Strain energy of each column over the sum of its terms' sizes, phi^T K phi / |phi|^T |K| |phi|, (n,).

    About 1e-15 for a rigid motion. The rounding error of a natural frequency is about eps / (2 ratio), relative.
    """
    size = np.abs(phi)
    summands = np.einsum("in,in->n", size, abs(K) @ size)
    return np.einsum("in,in->n", phi, K @ phi) / np.maximum(summands, np.finfo(float).tiny)


def check_residual(
    K: sparse.csr_array,
    M: sparse.csr_array,
    omega: Array,
    phi: Array,
    shift: float = 0.0,
    solve: Solve | None = None,
) -> None:
    """Raise RuntimeError when a mode phi (n_dof, k), omega (k,) [rad/s] does not satisfy K phi = omega^2 M phi to
    rounding.

    Where stiffnesses differ by many orders (bending and stretch of a slender beam), rounding of the large ones leaves
    more than RESIDUAL of the summands without harm. Such modes must satisfy the same bound in the energy of the
    residual, which bounds the relative error of omega^2: sqrt(r.A^-1 r / phi.A phi), r = K phi - omega^2 M phi, A = K +
    shift M; solve: b -> A^-1 b, if factors exist already.
    """
    size = np.abs(phi)
    summands = (abs(K) @ size + (abs(M) @ size) * omega**2).max(axis=0)
    rest = K @ phi - (M @ phi) * omega**2
    residual = np.abs(rest).max(axis=0) / summands
    if (doubtful := np.flatnonzero(residual > RESIDUAL)).size:
        A = K + shift * M if shift else K
        solve = solve or factorise(A).solve
        residual_energy = np.einsum("in,in->n", rest[:, doubtful], solve(np.ascontiguousarray(rest[:, doubtful])))
        mode_energy = np.einsum("in,in->n", phi[:, doubtful], A @ phi[:, doubtful])
        residual[doubtful] = np.sqrt(np.abs(residual_energy) / mode_energy)
    worst = int(np.argmax(residual))
    if residual[worst] > RESIDUAL:
        raise RuntimeError(
            f"mode {worst + 1} at {omega[worst] / (2 * np.pi):.6g} Hz has a residual of {residual[worst]:.1e} where "
            f"{RESIDUAL:.0e} is allowed; the eigen-solver has failed. Check for stiffnesses many orders apart."
        )


def warn_if_rounded(K: sparse.csr_array, omega: Array, phi: Array) -> None:
    """Warn when rounding in K (n_dof, n_dof) affects the frequencies omega (k,) [rad/s]: a fine mesh, or stiffnesses of
    different orders."""
    ratio = stiffness_ratio(K, phi)
    worst = int(np.argmin(ratio))
    if ratio[worst] < FEW_DIGITS:
        warn_of_physics(
            f"mode {worst + 1} at {omega[worst] / (2 * np.pi):.4g} Hz: its strain energy is {ratio[worst]:.1e} of the "
            f"terms it is summed from, below {FEW_DIGITS:.0e}, so that few digits of the frequency are right; use "
            "fewer elements of higher order, or stiffnesses less far apart"
        )


def _elastic_modes(
    K: sparse.csr_array, M: sparse.csr_array, n: int, n_null: int, shift: float, solve: Solve | None = None
) -> Modes:
    """Return n elastic modes above the n_null motions without stiffness, without splitting a close pair at the end."""
    solver = ShiftInverted(K, M, shift, solve)
    extra = max(4, n // 5)
    while True:
        theta, phi = solver.largest(min(n_null + n + extra, K.shape[0]), surely=n_null + n)
        exhausted = len(theta) < n_null + n + extra
        eigenvalues, phi = _sort_modes(theta, orthonormalise(M, phi), shift)
        is_null = without_stiffness(K, M, phi)
        null, phi, eigenvalues = phi[:, is_null], phi[:, ~is_null], np.maximum(eigenvalues[~is_null], 0.0)
        if null.shape[1] > n_null and shift == 0.0:
            return Modes(np.zeros(0), phi[:, :0], null)
        if null.shape[1] > n_null:
            n_null = null.shape[1]  # the rough count was too low: request again so that no elastic mode is missed
            continue
        omega = np.sqrt(eigenvalues)
        if exhausted and len(omega) < n:
            raise ValueError(
                f"{n} modes were requested, but the mass takes part in only {len(omega)} elastic motions; "
                f"request at most {len(omega)}."
            )
        m = count_without_split_cluster(omega, n) or (len(omega) if exhausted else None)
        if m is not None:
            break
        extra *= 2
    phi = canonical_modes(eigenvalues[:m], phi[:, :m])
    check_residual(K, M, omega[:m], phi, shift, solver.solve)
    warn_if_rounded(K, omega[:m], phi)
    return Modes(omega[:m], phi, canonical_modes(np.zeros(null.shape[1]), null), _cluster_note(n, omega[:m]))


def _cluster_note(n: int, omega: Array) -> str:
    if len(omega) == n:
        return ""
    a, b = omega[n - 1 : n + 1] / (2 * np.pi)
    note = f"{n} modes requested, {len(omega)} kept: modes {n} and {n + 1} at {a:.6g} and {b:.6g} Hz are a close pair"
    log.info(note)
    return note


def _sort_modes(theta: Array, phi: Array, shift: float) -> tuple[Array, Array]:
    """Eigenvalues omega^2 ascending and their shapes, from the inverse eigenvalues theta = 1 / (omega^2 + shift)."""
    eigenvalues = 1.0 / theta - shift
    order = np.argsort(eigenvalues, kind="stable")
    return eigenvalues[order], phi[:, order]


def _null_count(K: sparse.csr_array, M: sparse.csr_array) -> tuple[int, float]:
    """Rough number of motions without stiffness, and a rough lowest elastic eigenvalue to shift by."""
    scale = _typical_eigenvalue(K, M)
    for part in (1e-12, 1e-9, 1e-6):  # of a typical dof's eigenvalue; the smallest that can be factorised
        try:
            return _probe(K, M, part * scale)
        except SingularError:
            continue
    if K.diagonal().min() < 0:
        raise _indefinite_error(K)
    raise IdleError(np.flatnonzero((K.diagonal() == 0) & (M.diagonal() == 0)))


def without_stiffness(K: sparse.csr_array, M: sparse.csr_array, phi: Array) -> BoolArray:
    """Return a mask (n,) of the columns of phi (n_dof, n) that store no strain energy, relative to its summands or at
    all."""
    energy, mass = (np.einsum("in,in->n", phi, A @ phi) for A in (K, M))
    return (stiffness_ratio(K, phi) < NO_STIFFNESS) | (energy < NO_ENERGY * _typical_eigenvalue(K, M) * mass)


def _typical_eigenvalue(K: sparse.csr_array, M: sparse.csr_array) -> float:
    """Median of the ratio of stiffness to mass on the diagonals."""
    k, m = K.diagonal(), M.diagonal()
    both = (m > 0) & (k > 0)
    return float(np.median(k[both] / m[both])) if both.any() else 1.0


def _probe(K: sparse.csr_array, M: sparse.csr_array, shift: float) -> tuple[int, float]:
    """Number of motions without stiffness and lowest elastic eigenvalue, from a rough search about a small shift."""
    solver, count = ShiftInverted(K, M, shift), 10
    while True:
        theta, phi = solver.largest(min(count, K.shape[0]), tolerance=1e-4)
        eigenvalues, phi = _sort_modes(theta, phi, shift)
        elastic = ~without_stiffness(K, M, phi)
        if elastic.any():
            return int((~elastic).sum()), float(eigenvalues[elastic][0])
        if len(theta) < count:
            return len(theta), shift
        count *= 2
