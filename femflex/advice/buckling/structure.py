"""Linear buckling of a meshed, clamped structure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from femflex.advice.buckling.few_shapes import lowest_of_few
from femflex.arrays import Array, IntArray
from femflex.fem.eigen.modes import factorise
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import MarkerRows, marker_rows
from femflex.reduction.boundary.supported import Supported, supported
from femflex.reduction.inertia.accelerations import loads_of_linear_accelerations
from femflex.reduction.large_deflection.load_path import largest_displacement
from femflex.reduction.modes.buckling import roughly_lowest
from femflex.reduction.modes.modeset import ModeSet

STIFF = 1e3  # times the largest stiffness of a dof: what holds a marker in its place
FEW = 12  # shapes that pick an instant


@dataclass(frozen=True, eq=False)
class StructureBuckling:
    """The structure of a clamped set, as `bearing.Elastic`. groups: marker -> mesh group."""

    structure: Structure
    modes: ModeSet
    groups: Mapping[str, str]

    @property
    def on(self) -> Supported:
        """The structure on its supports: static answers, and every search of what buckles it, have the same factors."""
        return supported(self.structure, self.modes.held)

    @property
    def free(self) -> IntArray:
        """Numbers (n,) of the dofs without supports."""
        return self.on.free

    @property
    def K(self) -> sparse.csr_array:
        """Stiffness (n, n) [N/m, N, N m], initial stress included."""
        return self.on.K

    @property
    def kept(self) -> ReducedBuckling:
        """See Elastic."""
        return ReducedBuckling(self)

    @property
    def basis(self) -> Array:
        """See Elastic, with its shapes and units."""
        phi = self.modes.phi[self.free, :FEW]
        return np.asarray(phi / np.sqrt(np.einsum("ij,ij->j", phi, self.K @ phi)))

    @property
    def size(self) -> int:
        """See Elastic."""
        return len(self.free)

    @property
    def scale(self) -> tuple[float, float]:
        """See Elastic."""
        mass = sum(float(block.dm.sum()) for block in self.structure.inertia)
        return mass, float(np.linalg.norm(np.ptp(self.structure.mesh.points, axis=0)))

    @property
    def slowest(self) -> float:
        """See Elastic."""
        phi = self.basis
        return float(1.0 / np.einsum("ij,ij->j", phi, self.on.M @ phi).max())

    def knows(self, marker: str | None) -> bool:
        """See Elastic."""
        return marker is None or marker in self.groups

    def loads(self, marker: str | None) -> Array:
        """See Elastic, with its shapes and units."""
        if marker is None:
            return -loads_of_linear_accelerations(self.structure)
        rows = self._rows(marker)
        return np.asarray(sparse.vstack([rows.translation, rows.rotation]).toarray().T)

    def at(self, marker: str, A: Array) -> sparse.csr_array:
        """See Elastic, with its shapes and units."""
        rows = self._rows(marker)
        R = sparse.vstack([rows.translation, rows.rotation]).tocsr()[:, self.free]
        return (R.T @ (sparse.csr_array(A) @ R)).tocsr()

    def stress(self, load: Array) -> sparse.csr_array:
        """See Elastic, with its shapes and units."""
        return self.structure.internal_force.geometric_stiffness(self._answer(load))[self.free][:, self.free]

    def stress_in_basis(self, loads: Array) -> Array:
        """See Elastic, with its shapes and units."""
        shapes = np.zeros((self.structure.n_dof, self.basis.shape[1]))
        shapes[self.free] = self.basis
        return self.structure.internal_force.work_of_stress(self._answer(loads), shapes)

    def moved(self, load: Array) -> float:
        """See Elastic, with its shapes and units."""
        return largest_displacement(self.structure, self._answer(load))

    def lowest(self, K_sigma: sparse.csr_array, held: sparse.csr_array | None) -> tuple[float, Array]:
        """See Elastic, with its shapes and units."""
        try:
            K = self.K if held is None else (self.K + STIFF * self.K.diagonal().max() * held).tocsr()
            mu, x = roughly_lowest(K_sigma, K, self.on.factors if held is None else factorise(K))
        except (np.linalg.LinAlgError, RuntimeError):
            return 0.0, np.zeros(len(self.free))
        return mu, x / np.sqrt(x @ (K @ x))

    def _answer(self, load: Array) -> Array:
        """Static displacements (n_dof,) or (n_dof, k)."""
        return self.on.answers(load)

    def _rows(self, marker: str) -> MarkerRows:
        return marker_rows(self.structure, self.groups[marker])


@dataclass(frozen=True, eq=False)
class ReducedBuckling:
    """The same confined to the shapes of its set, as `bearing.Statics`.

    A derivative that follows bears load as one that is a coordinate: phi_i.K_sigma(x) phi_k = -theta_ik.f for a static
    answer x = K^-1 f, which is the work of the load on what follows.
    """

    whole: StructureBuckling

    @cached_property
    def K(self) -> Array:
        """Stiffness (n, n) [N/m, N, N m]."""
        phi = self.whole.modes.phi[self.whole.free]
        return np.asarray(phi.T @ (self.whole.K @ phi))

    def knows(self, marker: str | None) -> bool:
        """See Statics."""
        return self.whole.knows(marker)

    def loads(self, marker: str | None) -> Array:
        """See Statics, with its shapes and units."""
        return np.asarray(self.whole.modes.phi.T @ self.whole.loads(marker))

    def at(self, marker: str, A: Array) -> Array:
        """See Statics, with its shapes and units."""
        phi = self.whole.modes.phi[self.whole.free]
        return np.asarray(phi.T @ (self.whole.at(marker, A) @ phi))

    def stress(self, load: Array) -> Array:
        """See Statics, with its shapes and units."""
        phi = self.whole.modes.phi
        return self.whole.structure.internal_force.work_of_stress(phi @ np.linalg.solve(self.K, load[:, None]), phi)[0]

    def lowest(self, K_sigma: Array, held: Array | None) -> tuple[float, Array]:
        """See Statics, with its shapes and units."""
        return lowest_of_few(K_sigma, self.K, held)
