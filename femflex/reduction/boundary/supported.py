"""A structure on its supports: stiffness and mass without the dofs that are held, and factors made once for all uses.

One `Supported` per structure and set of held dofs serves modes, static answers, relaxation of initial stress and
judgements of buckling. Factors of 1e5 dofs take hundreds of MB; they go with the structure (`Structure.recalled`).

A structure that nothing holds is factorised on statically determinate supports instead. Loads without their rigid part,
balanced by the inertia of a rigid acceleration, leave these supports without reactions, and answers without their rigid
part do not depend on where they are (inertia relief).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg, sparse

from femflex.arrays import Array, IntArray
from femflex.fem.eigen.modes import IdleError, Modes, factorise, lowest_modes, without_stiffness
from femflex.fem.eigen.shift_invert import Factors, SingularError
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import independent_columns, rigid_shapes, stands_by_springs

SHOWN = 3  # dofs without stiffness and mass that a message names


@dataclass(frozen=True, eq=False)
class Supported:
    """Matrices of a structure with some dofs held, or none.

    whole_K, whole_M (n_dof, n_dof)   held (k,)
    R (n_dof, r)   rigid motions, zero at dofs held, of a structure that neither supports nor springs to ground hold
    """

    whole_K: sparse.csr_array
    whole_M: sparse.csr_array
    held: IntArray
    R: Array

    @cached_property
    def free(self) -> IntArray:
        """Numbers (n,) of dofs that are not held."""
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
        """Free dofs (m,) of which the stiffness is factorised: all that are left by determinate supports."""
        return np.setdiff1d(self.free, determinate_supports(self.R))

    @cached_property
    def K_stiff(self) -> sparse.csr_array:
        """Stiffness (m, m) of the `stiff` dofs."""
        return self.whole_K[self.stiff][:, self.stiff] if len(self.stiff) < len(self.free) else self.K

    @cached_property
    def factors(self) -> Factors:
        """Factors of `K_stiff`. Raises RuntimeError where it is singular."""
        return factorise(self.K_stiff)

    def answers(self, loads: Array) -> Array:
        """Static displacements (n_dof, k) [m, rad] or (n_dof,) under loads alike; without supports, of their balanced
        part."""
        x = np.zeros_like(loads)
        if self.R.shape[1]:
            loads = loads - self._MR @ (self._R.T @ loads)
        x[self.stiff] = self.factors.solve(np.ascontiguousarray(loads[self.stiff]))
        return x - self._R @ (self._MR.T @ x) if self.R.shape[1] else x

    def lowest_modes(self, n: int) -> Modes:
        """The n lowest elastic modes on the free dofs, by these factors (`fem.eigen.lowest_modes`).

        Of an unsupported structure they exclude its rigid motions, unless it has stiffness against these too.
        """
        if not self.R.shape[1]:
            return lowest_modes(self.K, self.M, n, solve=self._free_answer)
        if without_stiffness(self.whole_K, self.whole_M, self.R).all():
            found = lowest_modes(self.K, self.M, n, free=True, solve=self._free_answer)
            return found if found.null.shape[1] else replace(found, null=self._R[self.free])
        return lowest_modes(self.K, self.M, n, free=True)

    def _free_answer(self, load: Array) -> Array:
        """Static displacements of the free dofs under loads on them, (n,) or (n, k)."""
        try:
            if not self.R.shape[1]:
                return np.asarray(self.factors.solve(load))
            whole = np.zeros((self.whole_K.shape[0], *load.shape[1:]))
            whole[self.free] = load
            return self.answers(whole)[self.free]
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
    """The structure on these supports, numbers of dofs `held` (k,); the same object when it is wanted again.

    Dofs that nothing resists (`Structure.unresisted`) and that move no mass are held too.
    """
    return _known(structure, held, "K", structure.K)


def unstressed(structure: Structure, held: IntArray) -> Supported:
    """The structure with dofs held (k,), numbers, without the geometric stiffness of its initial stress."""
    return _known(structure, held, "K0" if structure.stressed else "K", structure.K0)


def lowest_modes_on(structure: Structure, held: IntArray, n: int) -> Modes:
    """`Supported.lowest_modes` of the structure with dofs held (k,), numbers; a second call returns the same object."""
    found: Modes = structure.recalled(("modes", n, held.tobytes()), lambda: _modes(structure, held, n))
    return found


def _modes(structure: Structure, held: IntArray, n: int) -> Modes:
    given = supported(structure, held)
    try:
        return given.lowest_modes(n)
    except IdleError as error:
        dofs = given.free[error.dofs]
        raise IdleError(dofs, _places_text(structure, dofs)) from None


def _places_text(structure: Structure, dofs: IntArray) -> str:
    """The first nodes and components that dofs move: ", such as ry of the node at (1, 0, 2) m"."""
    listed = []
    for dof in dofs[:SHOWN]:
        for rows, words in ((structure.translation, "xyz"), (structure.rotation, ("rx", "ry", "rz"))):
            column = np.abs(rows[:, [int(dof)]].toarray()[:, 0])
            if column.any():
                node, axis = divmod(int(column.argmax()), 3)
                place = ", ".join(f"{x:.4g}" for x in structure.mesh.points[node])
                listed.append(f"{words[axis]} of the node at ({place}) m")
                break
    return f", such as {'; '.join(listed)}" if listed else ""


def _known(structure: Structure, held: IntArray, which: str, K: sparse.csr_array) -> Supported:
    def make() -> Supported:
        R = np.zeros((structure.n_dof, 0))
        idle = structure.unresisted[structure.M.diagonal()[structure.unresisted] == 0]
        if not held.size:
            R = rigid_shapes(structure)
            R[idle] = 0.0
            R = R[:, independent_columns(R)]
            if stands_by_springs(K, structure.M, R):
                R = R[:, :0]
        return Supported(K, structure.M, np.union1d(np.asarray(held, np.int64), idle), R)

    found: Supported = structure.recalled((which, held.tobytes()), make)
    return found


def determinate_supports(R: Array) -> IntArray:
    """As many numbers of dofs as there are rigid motions R (n_dof, r), ascending, that hold them all."""
    if not R.shape[1]:
        return np.zeros(0, np.int64)
    return np.sort(linalg.qr(R.T, mode="r", pivoting=True)[1][: R.shape[1]]).astype(np.int64)
