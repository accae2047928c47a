"""How a beam on admissible functions buckles under what it bears."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from femflex.body import FlexibleBody
from femflex.body.burden import FIELD
from femflex.body.symmetric import hessian
from femflex.reduction.beam_buckling import whole_beam
from femflex.reduction.uniform_beam import BeamFunctions, UniformBeam

Array = NDArray[np.float64]


STIFF = 1e3  # times the stiffness of all coordinates: what holds a marker in its place


@dataclass(frozen=True, eq=False)
class BeamBearing:
    """A beam with functions enough, as `bearing.Elastic`. names: marker -> "root" or "tip"."""

    beam: UniformBeam
    functions: BeamFunctions
    names: Mapping[str, str]

    @cached_property
    def body(self) -> FlexibleBody:
        """The condensed beam with functions enough."""
        return whole_beam(self.beam, self.functions)

    @cached_property
    def K(self) -> Array:
        """Stiffness (n, n)."""
        return (self.body.strain.V1 + self.body.strain.V1.T) / 2

    @property
    def basis(self) -> Array:
        """See Elastic."""
        return np.diag(1.0 / np.sqrt(np.diag(self.K)))

    @property
    def swaying(self) -> tuple[Array, Array, Array]:
        """See Elastic."""
        n = self.body.n_modes
        return np.eye(n), self.K, self.body.moments.elastic_mass()[:n, :n]

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
        return float((np.diag(self.K) / np.diag(self.swaying[2])).min())

    def knows(self, marker: str | None) -> bool:
        """See Elastic."""
        return marker is None or marker in self.names

    def loads(self, marker: str | None) -> Array:
        """See Elastic."""
        moments = self.body.moments
        if marker is not None:
            tip = self.body.markers[self.names[marker]]
            return np.vstack([tip.phi, tip.psi]).T
        rows = np.concatenate([moments.first[1:, None, :], moments.second[0, :, 1:, :].swapaxes(0, 1)], axis=1)
        return -rows.reshape(-1, FIELD)

    def at(self, marker: str, A: Array) -> Array:
        """See Elastic."""
        tip, n = self.body.markers[self.names[marker]], self.body.n_modes
        R = np.vstack([tip.phi, tip.psi])[:, :n]
        return np.asarray(R.T @ A @ R)

    def stress(self, load: Array) -> Array:
        """See Elastic: 6 V2 d - f.A, with d = V1^-1 f and the load's work f.A on what follows."""
        n = self.body.n_modes
        answer = np.asarray(np.linalg.solve(self.K, load[:n]), float)
        return hessian(self.body.strain.V2, answer, 3) - np.tensordot(load[n:], self.body.slaves, axes=1)

    def lowest(self, K_sigma: Array, held: Array | None) -> tuple[float, Array]:
        """See Elastic."""
        K = self.K if held is None else self.K + STIFF * np.trace(self.K) / np.trace(held) * held
        mu, x = linalg.eigh(K_sigma, K, subset_by_index=[0, 0])
        return float(mu[0]), x[:, 0]
