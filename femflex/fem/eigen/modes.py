"""Lowest modes of (K, M) by shift-invert, sorted into shapes without stiffness and elastic modes.

K phi = omega^2 M phi with K and M symmetric, M semi-definite (massless dofs are allowed). The operator is
(K + shift M)^-1 M; its largest eigenvalues 1 / (omega^2 + shift) are found by Lanczos, or densely for small problems.
"""

from __future__ import annotations

import logging
import warnings
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.eigen.canonical import canonical, whole_clusters
from femflex.fem.eigen.shift_invert import (
    DENSE_DOFS,
    ShiftInverted,
    SingularError,
    Solve,
    dense_modes,
    factorised,
    orthonormal,
)
from femflex.warning import PhysicsWarning

__all__ = [
    "Modes",
    "check_residual",
    "dense_modes",
    "factorised",
    "lowest_modes",
    "orthonormal",
    "stiffness_ratio",
    "without_stiffness",
]

NO_STIFFNESS = 1e-15  # strain energy over the size of its summands; rounding leaves about 1e-17 of a rigid motion
NO_ENERGY = 1e-21  # eigenvalue over a dof's own below which a shape lies in dofs that have no stiffness at all
FEW_DIGITS = 1e-14  # the same ratio below which rounding of K may reach a hundredth of a natural frequency
RESIDUAL = 1e-9  # |K phi - omega^2 M phi| over the size of its summands, or else in energy

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest elastic modes of a structure and its shapes without stiffness.

    omega (n,)         natural frequencies, ascending [rad/s]
    phi   (n_dof, n)   M-orthonormal shapes, largest entry positive
    null  (n_dof, r)   M-orthonormal basis of rigid motions and mechanisms (no strain energy)
    note  str          says when more modes than asked are kept, and why; else empty
    """

    omega: Array
    phi: Array
    null: Array
    note: str = ""


class IdleError(ValueError):
    """Some motions have neither stiffness nor mass. dofs (k,): numbers of those that have none by themselves."""

    def __init__(self, dofs: IntArray, places: str = "") -> None:
        self.dofs = dofs
        super().__init__(
            f"some motions have neither stiffness nor mass ({len(dofs)} degrees of freedom by themselves{places}); "
            "give every member both, and leave one of the elements that meet at a node without a release."
        )


def lowest_modes(
    K: sparse.csr_array, M: sparse.csr_array, n: int, free: bool = False, solve: Solve | None = None
) -> Modes:
    """The n lowest elastic modes of (K [N/m], M [kg]), (n_dof, n_dof), or a few more where n would part a close pair.

    free: K is known to be singular, which saves the attempt to factorise it.
    solve: b -> K^-1 b by factors that exist already, b and the answer M-orthogonal to what K has no stiffness against.
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
            found = _elastic_modes(K, M, n, n_null=0, shift=0.0, solve=solve)
            if found.null.shape[1] == 0:
                return found
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
        raise _indefinite(K) from None


def _indefinite(K: sparse.csr_array) -> ValueError:
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

    Where stiffnesses lie many orders apart (bending and stretch of a slender beam) rounding in the stiff ones
    leaves more than RESIDUAL of the summands, and means nothing. Such modes are held to the same bound in the energy
    that is left, which bounds the relative error of omega^2: sqrt(r.A^-1 r / phi.A phi), r = K phi - omega^2 M phi,
    A = K + shift M; solve: b -> A^-1 b, where factors exist already.
    """
    size = np.abs(phi)
    summands = (abs(K) @ size + (abs(M) @ size) * omega**2).max(axis=0)
    rest = K @ phi - (M @ phi) * omega**2
    residual = np.abs(rest).max(axis=0) / summands
    if (doubtful := np.flatnonzero(residual > RESIDUAL)).size:
        A = K + shift * M if shift else K
        solve = solve or factorised(A).solve
        left = np.einsum("in,in->n", rest[:, doubtful], solve(np.ascontiguousarray(rest[:, doubtful])))
        stored = np.einsum("in,in->n", phi[:, doubtful], A @ phi[:, doubtful])
        residual[doubtful] = np.sqrt(np.abs(left) / stored)
    worst = int(np.argmax(residual))
    if residual[worst] > RESIDUAL:
        raise RuntimeError(
            f"mode {worst + 1} at {omega[worst] / (2 * np.pi):.6g} Hz has a residual of {residual[worst]:.1e} where "
            f"{RESIDUAL:.0e} is allowed; the eigen-solver has failed. Check for stiffnesses many orders apart."
        )


def warn_if_rounded(K: sparse.csr_array, omega: Array, phi: Array) -> None:
    """Warn when rounding in K (n_dof, n_dof) reaches the frequencies omega (k,) [rad/s]: a fine mesh, unlike
    stiffnesses."""
    ratio = stiffness_ratio(K, phi)
    worst = int(np.argmin(ratio))
    if ratio[worst] < FEW_DIGITS:
        warnings.warn(
            f"mode {worst + 1} at {omega[worst] / (2 * np.pi):.4g} Hz: its strain energy is {ratio[worst]:.1e} of the "
            f"terms it is summed from, below {FEW_DIGITS:.0e}, so that few digits of the frequency are right; use "
            "fewer elements of higher order, or stiffnesses less far apart",
            PhysicsWarning,
            stacklevel=4,
        )


def _elastic_modes(
    K: sparse.csr_array, M: sparse.csr_array, n: int, n_null: int, shift: float, solve: Solve | None = None
) -> Modes:
    """n elastic modes above the n_null motions without stiffness, a close pair at the end kept whole."""
    solver = ShiftInverted(K, M, shift, solve)
    extra = max(4, n // 5)
    while True:
        theta, phi = solver.largest(min(n_null + n + extra, K.shape[0]), surely=n_null + n)
        exhausted = len(theta) < n_null + n + extra
        eigenvalues, phi = _sorted(theta, orthonormal(M, phi), shift)
        is_null = without_stiffness(K, M, phi)
        null, phi, eigenvalues = phi[:, is_null], phi[:, ~is_null], np.maximum(eigenvalues[~is_null], 0.0)
        if null.shape[1] > n_null and shift == 0.0:
            return Modes(np.zeros(0), phi[:, :0], null)
        if null.shape[1] > n_null:
            n_null = null.shape[1]  # the rough count was short: ask again for as many elastic modes, none missed
            continue
        omega = np.sqrt(eigenvalues)
        if exhausted and len(omega) < n:
            raise ValueError(
                f"{n} modes were requested, but the mass takes part in only {len(omega)} elastic motions; "
                f"request at most {len(omega)}."
            )
        m = whole_clusters(omega, n) or (len(omega) if exhausted else None)
        if m is not None:
            break
        extra *= 2
    phi = canonical(eigenvalues[:m], phi[:, :m])
    check_residual(K, M, omega[:m], phi, shift, solver.solve)
    warn_if_rounded(K, omega[:m], phi)
    return Modes(omega[:m], phi, canonical(np.zeros(null.shape[1]), null), _cluster_note(n, omega[:m]))


def _cluster_note(n: int, omega: Array) -> str:
    if len(omega) == n:
        return ""
    a, b = omega[n - 1 : n + 1] / (2 * np.pi)
    note = f"{n} modes requested, {len(omega)} kept: modes {n} and {n + 1} at {a:.6g} and {b:.6g} Hz are a close pair"
    log.info(note)
    return note


def _sorted(theta: Array, phi: Array, shift: float) -> tuple[Array, Array]:
    """Eigenvalues omega^2 ascending and their shapes, from the inverse eigenvalues theta = 1 / (omega^2 + shift)."""
    eigenvalues = 1.0 / theta - shift
    order = np.argsort(eigenvalues, kind="stable")
    return eigenvalues[order], phi[:, order]


def _null_count(K: sparse.csr_array, M: sparse.csr_array) -> tuple[int, float]:
    """Rough number of motions without stiffness, and a rough lowest elastic eigenvalue to shift by."""
    scale = _typical_eigenvalue(K, M)
    for part in (1e-12, 1e-9, 1e-6):  # of a typical dof's own eigenvalue; the least that can be factorised
        try:
            return _probed(K, M, part * scale)
        except SingularError:
            continue
    if K.diagonal().min() < 0:
        raise _indefinite(K)
    raise IdleError(np.flatnonzero((K.diagonal() == 0) & (M.diagonal() == 0)))


def without_stiffness(K: sparse.csr_array, M: sparse.csr_array, phi: Array) -> BoolArray:
    """Which columns of phi (n_dof, n), numbers from 0, store no strain energy, neither relative to its summands nor
    at all."""
    energy, mass = (np.einsum("in,in->n", phi, A @ phi) for A in (K, M))
    return (stiffness_ratio(K, phi) < NO_STIFFNESS) | (energy < NO_ENERGY * _typical_eigenvalue(K, M) * mass)


def _typical_eigenvalue(K: sparse.csr_array, M: sparse.csr_array) -> float:
    """Median of a dof's own stiffness over its own mass."""
    k, m = K.diagonal(), M.diagonal()
    both = (m > 0) & (k > 0)
    return float(np.median(k[both] / m[both])) if both.any() else 1.0


def _probed(K: sparse.csr_array, M: sparse.csr_array, shift: float) -> tuple[int, float]:
    """Number of motions without stiffness and lowest elastic eigenvalue, from a rough search about a small shift."""
    solver, count = ShiftInverted(K, M, shift), 10
    while True:
        theta, phi = solver.largest(min(count, K.shape[0]), tolerance=1e-4)
        eigenvalues, phi = _sorted(theta, phi, shift)
        elastic = ~without_stiffness(K, M, phi)
        if elastic.any():
            return int((~elastic).sum()), float(eigenvalues[elastic][0])
        if len(theta) < count:
            return len(theta), shift
        count *= 2
