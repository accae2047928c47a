"""Linear buckling of a meshed, clamped structure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.eigen.modes import factorise
from femflex.fem.internal_force import InternalForce
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import MarkerRows, marker_rows
from femflex.reduction.boundary.supported import Supported, supported
from femflex.reduction.inertia.accelerations import loads_of_linear_accelerations
from femflex.reduction.large_deflection.load_path import largest_displacement
from femflex.reduction.modes.buckling import roughly_lowest
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.static_buckling.beam import buckling_force, lowest_of_few

STIFF = 1e3  # stiffness that fixes a marker, over the largest of a dof
BASIS_SHAPES = 12  # shapes that select the worst instant


@dataclass(frozen=True, eq=False)
class StructureBuckling:
    """The structure of a clamped set, as an `ElasticStructure`. groups: marker -> mesh group."""

    structure: Structure
    modes: ModeSet
    groups: Mapping[str, str]

    @property
    def clamped(self) -> Supported:
        """The structure on its supports; static responses and eigenvalue searches share its factors."""
        return supported(self.structure, self.modes.held)

    @property
    def free(self) -> IntArray:
        """Numbers (n,) of the dofs without supports."""
        return self.clamped.free

    @property
    def K(self) -> sparse.csr_array:
        """Stiffness (n, n) [N/m, N, N m], initial stress included."""
        return self.clamped.K

    @cached_property
    def elastic_force(self) -> InternalForce:
        """The elastic force whose stress buckles the structure."""
        return buckling_force(self.structure)

    @property
    def reduced(self) -> ReducedBuckling:
        """See ElasticStructure."""
        return ReducedBuckling(self)

    @property
    def basis(self) -> Array:
        """See ElasticStructure, with its shapes and units."""
        phi = self.modes.phi[self.free, :BASIS_SHAPES]
        return np.asarray(phi / np.sqrt(np.einsum("ij,ij->j", phi, self.K @ phi)))

    @property
    def size(self) -> int:
        """See ElasticStructure."""
        return len(self.free)

    @property
    def scale(self) -> tuple[float, float]:
        """See ElasticStructure."""
        mass = sum(float(block.dm.sum()) for block in self.structure.inertia)
        return mass, float(np.linalg.norm(np.ptp(self.structure.mesh.points, axis=0)))

    @property
    def least_omega_squared(self) -> float:
        """See ElasticStructure."""
        phi = self.basis
        return float(1.0 / np.einsum("ij,ij->j", phi, self.clamped.M @ phi).max())

    def has_marker(self, marker: str | None) -> bool:
        """See ElasticStructure."""
        return marker is None or marker in self.groups

    def loads(self, marker: str | None) -> Array:
        """See ElasticStructure, with its shapes and units."""
        if marker is None:
            return -loads_of_linear_accelerations(self.structure)
        rows = self._rows(marker)
        return np.asarray(sparse.vstack([rows.translation, rows.rotation]).toarray().T)

    def marker_matrix(self, marker: str, A: Array) -> sparse.csr_array:
        """See ElasticStructure, with its shapes and units."""
        marker_motion = self._rows(marker)
        R = sparse.vstack([marker_motion.translation, marker_motion.rotation]).tocsr()[:, self.free]
        return (R.T @ (sparse.csr_array(A) @ R)).tocsr()

    def stress(self, load: Array) -> sparse.csr_array:
        """See ElasticStructure, with its shapes and units."""
        return self.elastic_force.geometric_stiffness(self._static_response(load))[self.free][:, self.free]

    def stress_in_basis(self, loads: Array) -> Array:
        """See ElasticStructure, with its shapes and units."""
        shapes = np.zeros((self.structure.n_dof, self.basis.shape[1]))
        shapes[self.free] = self.basis
        return self.elastic_force.work_of_stress(self._static_response(loads), shapes)

    def largest_displacement(self, load: Array) -> float:
        """See ElasticStructure, with its shapes and units."""
        return largest_displacement(self.structure, self._static_response(load))

    def lowest(self, K_sigma: sparse.csr_array, constraint: sparse.csr_array | None) -> tuple[float, Array]:
        """See ElasticStructure, with its shapes and units."""
        try:
            K = self.K if constraint is None else (self.K + STIFF * self.K.diagonal().max() * constraint).tocsr()
            mu, x = roughly_lowest(K_sigma, K, self.clamped.factors if constraint is None else factorise(K))
        except (np.linalg.LinAlgError, RuntimeError):
            return 0.0, np.zeros(len(self.free))
        return mu, x / np.sqrt(x @ (K @ x))

    def _static_response(self, load: Array) -> Array:
        """Static displacements (n_dof,) or (n_dof, k)."""
        return self.clamped.answers(load)

    def _rows(self, marker: str) -> MarkerRows:
        return marker_rows(self.structure, self.groups[marker])


@dataclass(frozen=True, eq=False)
class ReducedBuckling:
    """The structure reduced to the shapes of its set, as a `StaticStructure`.

    A dependent derivative carries load like one that is a coordinate: phi_i.K_sigma(x) phi_k = -theta_ik.f for a static
    response x = K^-1 f, which is the work of the load on the dependent shapes.
    """

    full: StructureBuckling

    @cached_property
    def K(self) -> Array:
        """Stiffness (n, n) [N/m, N, N m]."""
        phi = self.full.modes.phi[self.full.free]
        return np.asarray(phi.T @ (self.full.K @ phi))

    def has_marker(self, marker: str | None) -> bool:
        """See StaticStructure."""
        return self.full.has_marker(marker)

    def loads(self, marker: str | None) -> Array:
        """See StaticStructure, with its shapes and units."""
        return np.asarray(self.full.modes.phi.T @ self.full.loads(marker))

    def marker_matrix(self, marker: str, A: Array) -> Array:
        """See StaticStructure, with its shapes and units."""
        phi = self.full.modes.phi[self.full.free]
        return np.asarray(phi.T @ (self.full.marker_matrix(marker, A) @ phi))

    def stress(self, load: Array) -> Array:
        """See StaticStructure, with its shapes and units."""
        phi = self.full.modes.phi
        return self.full.elastic_force.work_of_stress(phi @ np.linalg.solve(self.K, load[:, None]), phi)[0]

    def lowest(self, K_sigma: Array, constraint: Array | None) -> tuple[float, Array]:
        """See StaticStructure, with its shapes and units."""
        return lowest_of_few(K_sigma, self.K, constraint)
