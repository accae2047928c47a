"""Linear buckling of a beam on admissible functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg, sparse

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody
from femflex.body.symmetric import hessian
from femflex.fem.beam.strain import BeamStrain
from femflex.fem.eigen.shift_invert import factorise
from femflex.fem.internal_force import InternalForce
from femflex.fem.structure import Structure
from femflex.reduction.admissible import beam_body
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.boundary.markers import MarkerRows, marker_rows
from femflex.reduction.boundary.supported import Supported, supported
from femflex.reduction.inertia.accelerations import loads_of_linear_accelerations
from femflex.reduction.large_deflection.response_states import largest_displacement
from femflex.reduction.modes.buckling import roughly_lowest
from femflex.reduction.modes.vibration import ModeSet

# Linear buckling in few coordinates, and moments of beams that buckle them laterally.
#
# A constant moment about an axis of stiffness EI_1 buckles a simply supported beam sideways at pi sqrt(EI_2 GJ) / L,
# divided by the root of (1 - EI_2 / EI_1) (1 - GJ / EI_1) for the deflection before buckling, where EI_2 is the
# stiffness about the other axis (Trahair, Flexural-Torsional Buckling of Structures (1993)). Linear buckling neglects
# this deflection; here moments are multiplied by that root, which is exact for a constant moment and approximate for
# others (for a cantilever under a load at its tip see Hodges and Peters, Int. J. Solids Structures 11 (1975) 1269). The
# product vanishes for round tubes. Moments about a beam's weak axis are neglected: the beam would have to turn by
# several radians before it buckles.


FIELD = 12  # values of a field: b (3), then W by its columns (9)
STIFF = 1e3  # stiffness that fixes a marker, over the largest of a dof, or the sum of that of few coordinates
ROUNDING = 1e-9  # magnitude of an eigenvalue below which it is zero


def lateral_share(EI_1: Array | float, EI_2: Array | float, GJ: Array | float) -> Array:
    """Share [1] of a moment about the axis of stiffness EI_1 that buckles a beam laterally.

    EI_2: stiffness about the other axis; GJ: torsional stiffness [N m^2].

    >>> float(lateral_share(1.0, 1.0, 0.8)), float(lateral_share(1e4, 1.0, 4.0))  # a round tube, a thin strip
    (0.0, 0.999...)
    """
    largest = np.maximum(EI_1, np.finfo(float).tiny)
    other, twist = (np.clip(1.0 - np.asarray(stiffness) / largest, 0.0, 1.0) for stiffness in (EI_2, GJ))
    return np.asarray(np.sqrt(other * twist))


def buckling_force(structure: Structure) -> InternalForce:
    """The elastic force of a structure whose beams have the share of their bending stress that buckles them."""
    if not any(isinstance(block, BeamStrain) for block in structure.strain):
        return structure.internal_force
    blocks = [_with_share(block) if isinstance(block, BeamStrain) else block for block in structure.strain]
    return InternalForce(blocks, structure.T)


def _with_share(block: BeamStrain) -> BeamStrain:
    """The block with the moments about the principal axes of its bending stiffness multiplied by their shares."""
    bending = slice(1, 3)  # of the strains (eps, kappa_z, kappa_y, r kappa_x)
    EI, axes = np.linalg.eigh(block.elastic[..., bending, bending])
    GJ = block.elastic[..., 3, 3] * block.polar2
    shares = np.stack([lateral_share(EI[..., k], EI[..., 1 - k], GJ) for k in range(2)], axis=-1)
    elastic = block.elastic.copy()
    elastic[..., bending, :] = (axes * shares[..., None, :]) @ (axes.swapaxes(-1, -2) @ elastic[..., bending, :])
    return replace(block, elastic=elastic)


def lowest_of_few(K_sigma: Array, K: Array, constraint: Array | None) -> tuple[float, Array]:
    """Lowest eigenvalue mu [1] of K_sigma x = mu (K + C) x, 0 within rounding, and its shape x (n,), x.(K + C) x = 1.

    All matrices (n, n) [N/m, N, N m]; C is the constraint, taken as stiff.
    """
    K = K if constraint is None else K + STIFF * np.trace(K) / np.trace(constraint) * constraint
    mu, x = linalg.eigh(K_sigma, K, subset_by_index=[0, 0])
    return float(mu[0]) if abs(mu[0]) > ROUNDING else 0.0, x[:, 0]


POLYNOMIALS = 6  # polynomials of each field: error of 1e-4 in the lateral-torsional buckling load of a cantilever
THIN_SECTION = 1e-4  # radius of gyration over length of a section without rotary inertia


@dataclass(frozen=True, eq=False)
class BeamBuckling:
    """A beam with enough functions, with the interface of `StructureBuckling`.

    names: marker -> "root" or "tip"; reduced_basis: whether it has its own functions only
    """

    beam: UniformBeam
    functions: BeamFunctions
    names: Mapping[str, str]
    reduced_basis: bool = False

    @cached_property
    def body(self) -> FlexibleBody:
        """The condensed beam on enough functions, or on its own."""
        functions = replace(self.functions, axial=0)
        return (
            beam_body(self.beam, functions, strain="condensed")
            if self.reduced_basis
            else whole_beam(self.beam, self.functions)
        )

    @property
    def reduced(self) -> BeamBuckling:
        """See StructureBuckling."""
        return replace(self, reduced_basis=True)

    @cached_property
    def K(self) -> Array:
        """Stiffness (n, n) [N/m, N, N m]."""
        return (self.body.strain.V1 + self.body.strain.V1.T) / 2

    @property
    def basis(self) -> Array:
        """See StructureBuckling, with its shapes and units."""
        return np.diag(1.0 / np.sqrt(np.diag(self.K)))

    @property
    def size(self) -> int:
        """See StructureBuckling."""
        return self.body.n_modes

    @cached_property
    def _lateral_shares(self) -> Array:
        """Share (n,) of the moments in each shape that buckles the beam laterally; 1 in torsion and with fixed tips."""
        tip = self.body.markers["tip"]
        phi = np.abs(self.beam.frame @ tip.phi[:, : self.size])
        psi = np.abs(self.beam.frame @ tip.psi[:, : self.size]) * self.beam.length
        twist, y, z = psi[0], np.maximum(phi[1], psi[2]), np.maximum(phi[2], psi[1])
        in_y, in_z = (
            lateral_share(EI_1, EI_2, self.beam.GJ)
            for EI_1, EI_2 in ((self.beam.EIz, self.beam.EIy), (self.beam.EIy, self.beam.EIz))
        )
        return np.where(twist >= np.maximum(y, z), 1.0, np.where(y > z, in_y, in_z))

    @property
    def scale(self) -> tuple[float, float]:
        """See StructureBuckling."""
        return self.body.moments.mass, self.beam.length

    @property
    def least_omega_squared(self) -> float:
        """See StructureBuckling."""
        n = self.body.n_modes
        return float((np.diag(self.K) / np.diag(self.body.moments.elastic_mass())[:n]).min())

    def has_marker(self, marker: str | None) -> bool:
        """See StructureBuckling."""
        return marker is None or marker in self.names

    def loads(self, marker: str | None) -> Array:
        """See StructureBuckling, with its shapes and units."""
        moments = self.body.moments
        if marker is not None:
            end = self.body.markers[self.names[marker]]
            return np.vstack([end.phi, end.psi]).T
        rows = np.concatenate([moments.first[1:, None, :], moments.second[0, :, 1:, :].swapaxes(0, 1)], axis=1)
        return -rows.reshape(-1, FIELD)

    def marker_matrix(self, marker: str, A: Array) -> Array:
        """See StructureBuckling, with its shapes and units."""
        end, n = self.body.markers[self.names[marker]], self.body.n_modes
        R = np.vstack([end.phi, end.psi])[:, :n]
        return np.asarray(R.T @ A @ R)

    def stress(self, load: Array) -> Array:
        """See StructureBuckling, with its shapes and units: 6 V2 d - f.A, with d = V1^-1 f and the load's work f.A on
        dependent shapes."""
        n = self.body.n_modes
        answer = self._lateral_shares * np.asarray(np.linalg.solve(self.K, load[:n]), float)
        return hessian(self.body.strain.V2, answer, 3) - np.tensordot(load[n:], self.body.slaves, axes=1)

    def stress_in_basis(self, loads: Array) -> Array:
        """See StructureBuckling, with its shapes and units."""
        return np.stack([self.basis.T @ self.stress(load) @ self.basis for load in loads.T])

    def largest_displacement(self, load: Array) -> float:
        """See StructureBuckling, with its shapes and units: of the ends, in addition to the rigid motions."""
        n = self.body.n_modes
        answer = np.linalg.solve(self.K, load[:n])
        return max(float(np.linalg.norm(marker.phi[:, :n] @ answer)) for marker in self.body.markers.values())

    def lowest(self, K_sigma: Array, constraint: Array | None) -> tuple[float, Array]:
        """See StructureBuckling, with its shapes and units."""
        return lowest_of_few(K_sigma, self.K, constraint)


def whole_beam(beam: UniformBeam, functions: BeamFunctions) -> FlexibleBody:
    """The condensed beam with enough functions for its buckling load."""
    n_bending = max(functions.y, functions.z)
    richer_functions = BeamFunctions(
        *(max(POLYNOMIALS, n_bending),) * 2, 0, max(POLYNOMIALS, functions.torsion), "polynomial", functions.ends
    )
    if not (beam.ry or beam.rz):
        beam = beam.model_copy(update=dict.fromkeys(("ry", "rz"), THIN_SECTION * beam.length))
    return beam_body(beam, richer_functions, strain="condensed")


BASIS_SHAPES = 12  # shapes that select the worst instant


@dataclass(frozen=True, eq=False)
class StructureBuckling:
    """The structure of a clamped set in a static buckling analysis; arrays over its n coordinates without supports.

    groups: marker -> mesh group
    """

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
        """The structure reduced to the shapes of its body."""
        return ReducedBuckling(self)

    @property
    def basis(self) -> Array:
        """A few shapes (n, m) that select the worst instant."""
        phi = self.modes.phi[self.free, :BASIS_SHAPES]
        return np.asarray(phi / np.sqrt(np.einsum("ij,ij->j", phi, self.K @ phi)))

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return len(self.free)

    @property
    def scale(self) -> tuple[float, float]:
        """Mass [kg] and size [m]."""
        mass = sum(float(block.dm.sum()) for block in self.structure.inertia)
        return mass, float(np.linalg.norm(np.ptp(self.structure.mesh.points, axis=0)))

    @property
    def least_omega_squared(self) -> float:
        """Least omega^2 of the basis [1/s^2]."""
        phi = self.basis
        return float(1.0 / np.einsum("ij,ij->j", phi, self.clamped.M @ phi).max())

    def has_marker(self, marker: str | None) -> bool:
        """Whether loads at a marker, or over the whole body (None), can be applied."""
        return marker is None or marker in self.groups

    def loads(self, marker: str | None) -> Array:
        """Generalised forces (n_load, 6) of unit force and torque at a marker, (n_load, 12) of unit fields."""
        if marker is None:
            return -loads_of_linear_accelerations(self.structure)
        rows = self._rows(marker)
        return np.asarray(sparse.vstack([rows.translation, rows.rotation]).toarray().T)

    def marker_matrix(self, marker: str, A: Array) -> sparse.csr_array:
        """R^T A R (n, n), R (6, n) the translation and rotation of a marker."""
        marker_motion = self._rows(marker)
        R = sparse.vstack([marker_motion.translation, marker_motion.rotation]).tocsr()[:, self.free]
        return (R.T @ (sparse.csr_array(A) @ R)).tocsr()

    def stress(self, load: Array) -> sparse.csr_array:
        """K_sigma (n, n) [N/m, N, N m] of the static response to a load (n_load,)."""
        return self.elastic_force.geometric_stiffness(self._static_response(load))[self.free][:, self.free]

    def stress_in_basis(self, loads: Array) -> Array:
        """`stress` of loads (n_load, k) in the shapes of the basis (k, m, m)."""
        shapes = np.zeros((self.structure.n_dof, self.basis.shape[1]))
        shapes[self.free] = self.basis
        return self.elastic_force.work_of_stress(self._static_response(loads), shapes)

    def largest_displacement(self, load: Array) -> float:
        """Largest displacement [m] of the static response to a load (n_load,)."""
        return largest_displacement(self.structure, self._static_response(load))

    def lowest(self, K_sigma: sparse.csr_array, constraint: sparse.csr_array | None) -> tuple[float, Array]:
        """Lowest eigenvalue mu [1] of K_sigma x = mu (K + C) x and its shape x (n,), x.(K + C) x = 1; 0: not found.

        K_sigma (n, n) [N/m, N, N m]. constraint: C, the `marker_matrix` of the fixed markers, taken as stiff.
        """
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
    """The structure reduced to the shapes of its set, with the interface of `StructureBuckling`.

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
        """See StructureBuckling."""
        return self.full.has_marker(marker)

    def loads(self, marker: str | None) -> Array:
        """See StructureBuckling, with its shapes and units."""
        return np.asarray(self.full.modes.phi.T @ self.full.loads(marker))

    def marker_matrix(self, marker: str, A: Array) -> Array:
        """See StructureBuckling, with its shapes and units."""
        phi = self.full.modes.phi[self.full.free]
        return np.asarray(phi.T @ (self.full.marker_matrix(marker, A) @ phi))

    def stress(self, load: Array) -> Array:
        """See StructureBuckling, with its shapes and units."""
        phi = self.full.modes.phi
        return self.full.elastic_force.work_of_stress(phi @ np.linalg.solve(self.K, load[:, None]), phi)[0]

    def lowest(self, K_sigma: Array, constraint: Array | None) -> tuple[float, Array]:
        """See StructureBuckling, with its shapes and units."""
        return lowest_of_few(K_sigma, self.K, constraint)
