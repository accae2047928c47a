"""A structure on its supports: stiffness and mass of the free dofs, and their factors, computed once.

One `Supported` per structure and set of fixed dofs serves vibration modes, static responses, the relaxation of initial
stress and buckling. Factors of 1e5 dofs take hundreds of MB; they are deleted with the structure
(`Structure.recalled`).

A structure without supports is factorised on statically determinate ones. Loads balanced by the inertia of a rigid
acceleration cause no reactions in these, and responses without their rigid part do not depend on the choice of the
supports (inertia relief).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import SuperLU, splu

from femflex.arrays import Array, IntArray
from femflex.fem.eigen.modes import IdleError, Modes, lowest_modes, without_stiffness
from femflex.fem.eigen.shift_invert import Factors, SingularError, factorise
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import independent_columns, is_held_by_springs, rigid_shapes

SHOWN = 3  # dofs without stiffness and mass that a message lists
ACCURATE = 1e-9  # residual over the size of its summands, up to which a solution with diagonal pivots is used


@dataclass(frozen=True, eq=False)
class Supported:
    """The matrices of a structure of which some dofs may be fixed.

    whole_K, whole_M (n_dof, n_dof)   held (k,)
    R (n_dof, r)   rigid motions of a structure without supports and springs to ground; zero at fixed dofs
    """

    whole_K: sparse.csr_array
    whole_M: sparse.csr_array
    held: IntArray
    R: Array

    @cached_property
    def free(self) -> IntArray:
        """Numbers (n,) of the dofs that are not fixed."""
        return np.delete(np.arange(self.whole_K.shape[0]), self.held)

    @cached_property
    def K(self) -> sparse.csr_array:
        """Stiffness (n, n) [N/m, N, N m] of the free dofs."""
        return self.whole_K[self.free][:, self.free] if self.held.size else self.whole_K

    @cached_property
    def M(self) -> sparse.csr_array:
        """Mass (n, n) [kg, kg m, kg m^2] of the free dofs."""
        return self.whole_M[self.free][:, self.free] if self.held.size else self.whole_M

    @cached_property
    def stiff(self) -> IntArray:
        """The free dofs (m,) whose stiffness is factorised: all but those of determinate supports."""
        return np.setdiff1d(self.free, determinate_supports(self.R))

    @cached_property
    def K_stiff(self) -> sparse.csr_array:
        """Stiffness (m, m) of the `stiff` dofs."""
        return self.whole_K[self.stiff][:, self.stiff] if len(self.stiff) < len(self.free) else self.K

    @cached_property
    def factors(self) -> Factors:
        """The factors of `K_stiff`. Raises RuntimeError if it is singular."""
        return factorise(self.K_stiff)

    def answers(self, loads: Array) -> Array:
        """Static displacements (n_dof, k) [m, rad] or (n_dof,) under loads of the same shape.

        Without supports these are the displacements under the loads balanced by inertia.
        """
        x = np.zeros_like(loads)
        if self.R.shape[1]:
            loads = loads - self._MR @ (self._R.T @ loads)
        x[self.stiff] = self.factors.solve(np.ascontiguousarray(loads[self.stiff]))
        return x - self._R @ (self._MR.T @ x) if self.R.shape[1] else x

    def lowest_modes(self, n: int) -> Modes:
        """The n lowest elastic modes on the free dofs, by these factors (`fem.eigen.lowest_modes`).

        For an unsupported structure they exclude its rigid motions, unless it has stiffness against these too.
        """
        if not self.R.shape[1]:
            return lowest_modes(self.K, self.M, n, solve=self._free_answer)
        if without_stiffness(self.whole_K, self.whole_M, self.R).all():
            modes = lowest_modes(self.K, self.M, n, free=True, solve=self._free_answer)
            return modes if modes.null.shape[1] else replace(modes, null=self._R[self.free])
        return lowest_modes(self.K, self.M, n, free=True)

    def _free_answer(self, load: Array) -> Array:
        """Static displacements of the free dofs under loads on them, (n,) or (n, k)."""
        try:
            if not self.R.shape[1]:
                return np.asarray(self.factors.solve(load))
            all_loads = np.zeros((self.whole_K.shape[0], *load.shape[1:]))
            all_loads[self.free] = load
            return self.answers(all_loads)[self.free]
        except RuntimeError as error:
            raise SingularError from error

    @cached_property
    def _R(self) -> Array:
        """The rigid motions, M-orthonormal."""
        L = np.linalg.cholesky(self.R.T @ (self.whole_M @ self.R))
        return np.asarray(linalg.solve_triangular(L, self.R.T, lower=True).T)

    @cached_property
    def _MR(self) -> Array:
        return np.asarray(self.whole_M @ self._R)


def supported(structure: Structure, held: IntArray) -> Supported:
    """The structure with the dofs of numbers `held` (k,) fixed; later calls return the same object.

    Dofs without stiffness (`Structure.unresisted`) and mass are fixed too.
    """
    return _recalled_supported(structure, held, "K", structure.K)


def unstressed(structure: Structure, held: IntArray) -> Supported:
    """The structure with the dofs of numbers `held` (k,) fixed, without geometric stiffness of its initial stress."""
    return _recalled_supported(structure, held, "K0" if structure.stressed else "K", structure.K0)


def lowest_modes_on(structure: Structure, held: IntArray, n: int) -> Modes:
    """`Supported.lowest_modes` with the dofs of numbers `held` (k,) fixed; later calls return the same object."""
    modes: Modes = structure.recalled(("modes", n, held.tobytes()), lambda: _lowest_modes(structure, held, n))
    return modes


def _lowest_modes(structure: Structure, held: IntArray, n: int) -> Modes:
    on_supports = supported(structure, held)
    try:
        return on_supports.lowest_modes(n)
    except IdleError as error:
        dofs = on_supports.free[error.dofs]
        raise IdleError(dofs, _places_text(structure, dofs)) from None


def _places_text(structure: Structure, dofs: IntArray) -> str:
    """A text on the first nodes and components that dofs move: ", such as ry of the node at (1, 0, 2) m"."""
    listed = []
    for dof in dofs[:SHOWN]:
        for rows, components in ((structure.translation, "xyz"), (structure.rotation, ("rx", "ry", "rz"))):
            column = np.abs(rows[:, [int(dof)]].toarray()[:, 0])
            if column.any():
                node, axis = divmod(int(column.argmax()), 3)
                position = ", ".join(f"{x:.4g}" for x in structure.mesh.points[node])
                listed.append(f"{components[axis]} of the node at ({position}) m")
                break
    return f", such as {'; '.join(listed)}" if listed else ""


def _recalled_supported(structure: Structure, held: IntArray, which: str, K: sparse.csr_array) -> Supported:
    def make() -> Supported:
        R = np.zeros((structure.n_dof, 0))
        idle = structure.unresisted[structure.M.diagonal()[structure.unresisted] == 0]
        if not held.size:
            R = rigid_shapes(structure)
            R[idle] = 0.0
            R = R[:, independent_columns(R)]
            if is_held_by_springs(K, structure.M, R):
                R = R[:, :0]
        return Supported(K, structure.M, np.union1d(np.asarray(held, np.int64), idle), R)

    result: Supported = structure.recalled((which, held.tobytes()), make)
    return result


def determinate_supports(R: Array) -> IntArray:
    """Numbers (r,) of dofs, ascending, that prevent all rigid motions R (n_dof, r) if fixed."""
    if not R.shape[1]:
        return np.zeros(0, np.int64)
    return np.sort(linalg.qr(R.T, mode="r", pivoting=True)[1][: R.shape[1]]).astype(np.int64)


def factors(K: sparse.csr_array) -> SuperLU:
    """Factors of a symmetric matrix (n, n) in any unit, pivots on its diagonal: their signs are those of its
    eigenvalues."""
    return splu(
        K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True, "Equil": False}
    )


def negative_pivots(solver: Factors) -> int:
    """The number of negative eigenvalues of a factorised symmetric matrix; zero if it has Cholesky factors."""
    return int(np.sum(solver.U.diagonal() < 0.0)) if isinstance(solver, SuperLU) else 0


def solve_tangent(K: sparse.csr_array, b: Array) -> Array:
    """K^-1 b of a symmetric matrix and columns b (n, k).

    Past a limit point a tangent is not positive, and a pivot on the diagonal may be small. Then, and only then, rows
    are exchanged: that breaks symmetry, fills the factors, and takes fifty times as long on a large mesh.
    """
    b = np.ascontiguousarray(b)
    try:
        x = factors(K).solve(b)
        summands = abs(K) @ np.abs(x) + np.abs(b)
        if np.all(np.abs(K @ x - b).max(axis=0) <= ACCURATE * summands.max(axis=0)):
            return np.asarray(x)
    except RuntimeError:  # a pivot that is zero
        pass
    return np.asarray(splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A").solve(b))
