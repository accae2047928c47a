"""Linear buckling of a beam on admissible functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femflex.advice.buckling.applied_load import FIELD
from femflex.advice.buckling.few_shapes import lowest_of_few
from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.body.symmetric import hessian
from femflex.reduction.admissible import beam_body
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam

ENOUGH = 6  # polynomials of each field: 1e-4 in the load at which a cantilever tips over
THIN = 1e-4  # radius of gyration over length of a section that is given no inertia


@dataclass(frozen=True, eq=False)
class BeamBuckling:
    """A beam with functions enough, as `bearing.Elastic`. names: marker -> "root" or "tip"; own: on its own functions
    alone."""

    beam: UniformBeam
    functions: BeamFunctions
    names: Mapping[str, str]
    own: bool = False

    @cached_property
    def body(self) -> FlexibleBody:
        """The condensed beam on functions enough, or its own."""
        own = replace(self.functions, axial=0)
        return beam_body(self.beam, own, strain="condensed") if self.own else whole_beam(self.beam, self.functions)

    @property
    def kept(self) -> BeamBuckling:
        """See Elastic."""
        return replace(self, own=True)

    @cached_property
    def K(self) -> Array:
        """Stiffness (n, n) [N/m, N, N m]."""
        return (self.body.strain.V1 + self.body.strain.V1.T) / 2

    @property
    def basis(self) -> Array:
        """See Elastic, with its shapes and units."""
        return np.diag(1.0 / np.sqrt(np.diag(self.K)))

    @property
    def size(self) -> int:
        """See Elastic."""
        return self.body.n_modes

    @property
    def scale(self) -> tuple[float, float]:
        """See Elastic."""
        return self.body.moments.mass, self.beam.length

    @property
    def slowest(self) -> float:
        """See Elastic."""
        n = self.body.n_modes
        return float((np.diag(self.K) / np.diag(self.body.moments.elastic_mass())[:n]).min())

    def knows(self, marker: str | None) -> bool:
        """See Elastic."""
        return marker is None or marker in self.names

    def loads(self, marker: str | None) -> Array:
        """See Elastic, with its shapes and units."""
        moments = self.body.moments
        if marker is not None:
            tip = self.body.markers[self.names[marker]]
            return np.vstack([tip.phi, tip.psi]).T
        rows = np.concatenate([moments.first[1:, None, :], moments.second[0, :, 1:, :].swapaxes(0, 1)], axis=1)
        return -rows.reshape(-1, FIELD)

    def at(self, marker: str, A: Array) -> Array:
        """See Elastic, with its shapes and units."""
        tip, n = self.body.markers[self.names[marker]], self.body.n_modes
        R = np.vstack([tip.phi, tip.psi])[:, :n]
        return np.asarray(R.T @ A @ R)

    def stress(self, load: Array) -> Array:
        """See Elastic, with its shapes and units: 6 V2 d - f.A, with d = V1^-1 f and the load's work f.A on what
        follows."""
        n = self.body.n_modes
        answer = np.asarray(np.linalg.solve(self.K, load[:n]), float)
        return hessian(self.body.strain.V2, answer, 3) - np.tensordot(load[n:], self.body.slaves, axes=1)

    def stress_in_basis(self, loads: Array) -> Array:
        """See Elastic, with its shapes and units."""
        return np.stack([self.basis.T @ self.stress(load) @ self.basis for load in loads.T])

    def moved(self, load: Array) -> float:
        """See Elastic, with its shapes and units: what the ends move, in addition to the rigid motions."""
        n = self.body.n_modes
        answer = np.linalg.solve(self.K, load[:n])
        return max(float(np.linalg.norm(one.phi[:, :n] @ answer)) for one in self.body.markers.values())

    def lowest(self, K_sigma: Array, held: Array | None) -> tuple[float, Array]:
        """See Elastic, with its shapes and units."""
        return lowest_of_few(K_sigma, self.K, held)


def whole_beam(beam: UniformBeam, functions: BeamFunctions) -> FlexibleBody:
    """The condensed beam with functions enough to buckle as it does."""
    bent = max(functions.y, functions.z)
    enough = BeamFunctions(*(max(ENOUGH, bent),) * 2, 0, max(ENOUGH, functions.torsion), "polynomial", functions.ends)
    turning = beam if beam.ry or beam.rz else replace(beam, ry=THIN * beam.length, rz=THIN * beam.length)
    return beam_body(turning, enough, strain="condensed")
