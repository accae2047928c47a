"""Linear buckling of a body under all its loads, at the worst instant of a motion.

K_sigma is linear in the load. The loads of all instants are combinations of a few patterns; their K_sigma in a few
shapes selects the worst instant, at which the full structure is assessed. No dynamic factor is applied to sudden loads:
the oscillation about their static stress is faster than the motion in the buckling shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.fem.connections.connection import skew
from femflex.reduction.limits import CLEARLY_LARGER, LARGE_BUCKLED_DEFLECTION
from femflex.reduction.static_buckling.elastic_structures import FIELD, BeamBuckling, ReducedBuckling, StructureBuckling

WRENCH = 6  # force and torque


@dataclass(frozen=True, eq=False)
class AppliedLoad:
    """One load on a body at n_t instants, body axes.

    name     of the load, as reported
    marker   where it acts; None: all over the body, as a field of accelerations -(b + W r), r from the body's origin
    values   (n_t, 12) b and W by its columns [m/s^2, 1/s^2]; or (n_t, 6) force and torque at the marker [N, N m]
    wrench   (n_t, 6) force and torque as reported
    arm      (n_t, 3) from the marker to where the force acts, on the attached body that turns with it [m]
    follows  whether the force turns with the marker, or keeps its direction
    n_constrained  number of components of the marker's motion that it constrains: 3 for translation, where the force is
             that of a loop; 6 for translation and rotation; 0 for none
    """

    name: str
    marker: str | None
    values: Array
    wrench: Array
    arm: Array = field(default_factory=lambda: np.zeros((1, 3)))
    follows: bool = False
    n_constrained: int = 0

    def size(self, row: int) -> str:
        """Force and torque at an instant, in words."""
        sizes = zip(np.linalg.norm(self.wrench[row].reshape(2, 3), axis=1), ("N", "N m"), strict=True)
        return " and ".join(f"{size:.4g} {unit}" for size, unit in sizes if size > 0.0) or "0 N"

    def load_stiffness(self, row: int) -> Array:
        """The matrix A (6, 6) [N, N m] of the force and torque A (0, theta) added at the marker when it turns by theta.

        A force that keeps its direction at an arm r adds the torque (theta x r) x F = (r F^T - r.F) theta, of which the
        symmetric part has a potential (the torque itself counts as half turning with the marker).
        """
        A = np.zeros((6, 6))
        if self.marker is None:
            return A
        force, torque = self.values[row].reshape(2, 3)
        if self.follows:
            A[:3, 3:], A[3:, 3:] = -skew(force), -skew(torque)
        else:
            arm = self.arm[row % len(self.arm)]
            A[3:, 3:] = (np.outer(arm, force) + np.outer(force, arm)) / 2 - (arm @ force) * np.eye(3)
        return A


@dataclass(frozen=True)
class BucklingResult:
    """Load over buckling load of a body, under all its loads at an instant.

    ratio   load over buckling load, 1 / lambda of det(K + lambda K_sigma) = 0; 0 where it cannot buckle
    row     of the instant
    shares  (n,) contribution of each load to the ratio; they add up to it. Zero where the ratio is small
    """

    ratio: float
    row: int
    shares: tuple[float, ...]


ROUNDING = 1e-7  # of mass x size x least omega^2, which is 12 EI / L^2 for a column: a smaller load is rounding
SMALL_PATTERN = 1e-3  # of the largest load: patterns below it are neglected in selecting the instant
PATTERNS, FEWER_PATTERNS = 6, 2  # largest number of patterns, and that for more than MANY_COORDINATES
MANY_COORDINATES = 20_000  # coordinates above which each pattern costs a tenth of the modes


Statics = StructureBuckling | BeamBuckling | ReducedBuckling


@dataclass(frozen=True, eq=False)
class BucklingAnalysis:
    """Linear buckling of a body under all its loads together."""

    elastic: StructureBuckling | BeamBuckling

    def worst_instant(self, applied: Sequence[AppliedLoad], shares_from: float = 0.0) -> BucklingResult:
        """Largest load over buckling load of all loads together, over their instants.

        shares_from: ratio above which the share of each load is computed.
        """
        index = [k for k, load in enumerate(applied) if self.elastic.has_marker(load.marker) and _is_active(load)]
        active = [applied[k] for k in index]
        rows = self._rows(active) if active else []
        if not rows:
            return BucklingResult(0.0, 0, (0.0,) * len(applied))
        worst = max((self._assess(active, row, shares_from) for row in rows), key=lambda result: result.ratio)
        shares = np.zeros(len(applied))
        shares[index] = worst.shares
        return BucklingResult(worst.ratio, worst.row, tuple(shares.tolist()))

    def reduced_ratio(self, applied: Sequence[AppliedLoad], row: int) -> float:
        """Load over buckling load in the reduced basis, at one instant; follower loads count as dead loads."""
        reduced = self.elastic.reduced
        active = [load for load in applied if reduced.has_marker(load.marker) and _is_active(load)]
        return max(0.0, -_lowest_eigenvalue(reduced, active, row)[0])

    def _rows(self, applied: Sequence[AppliedLoad]) -> list[int]:
        """Rows of the instants among which the worst is; none where all loads are rounding."""
        mass, size = self.elastic.scale
        units = {FIELD: np.repeat([mass, mass * size], [3, 9]), WRENCH: np.repeat([1.0, 1.0 / size], 3)}
        values = np.hstack([load.values for load in applied])
        sizes = np.concatenate([units[load.values.shape[1]] for load in applied])
        if np.abs(values * sizes).max() <= ROUNDING * mass * size * self.elastic.least_omega_squared:
            return []
        if np.ptp(values * sizes, axis=0).max() <= SMALL_PATTERN * np.abs(values * sizes).max():
            return [0]
        amounts, weights, patterns = np.linalg.svd(values * sizes, full_matrices=False)
        count = min(
            int(np.sum(weights > SMALL_PATTERN * weights[0])),
            PATTERNS if self.elastic.size <= MANY_COORDINATES else FEWER_PATTERNS,
        )
        amounts, patterns = (amounts * weights)[:, :count], patterns[:count] / sizes
        largest = int(np.linalg.norm(amounts, axis=1).argmax())
        if count == 1:
            opposite = int((amounts[:, 0] * np.sign(amounts[largest, 0])).argmin())
            return [largest, opposite] if amounts[opposite, 0] * amounts[largest, 0] < 0.0 else [largest]
        loads = np.hstack([self.elastic.loads(load.marker) for load in applied]) @ patterns.T
        reduced = self.elastic.stress_in_basis(loads)
        parts = -np.linalg.eigvalsh(np.einsum("tp,pij->tij", amounts, reduced))[:, 0]
        worst = int(parts.argmax())
        return [worst] if parts[worst] > CLEARLY_LARGER * parts[largest] else sorted({worst, largest})

    def _assess(self, applied: Sequence[AppliedLoad], row: int, shares_from: float) -> BucklingResult:
        """Load over buckling load at an instant."""
        structure = self.elastic
        if any(load.follows and load.values[row].any() for load in applied):  # has no static buckling load
            return BucklingResult(0.0, row, (0.0,) * len(applied))
        mu, x = _lowest_eigenvalue(structure, applied, row)
        if mu >= 0.0 or self._exceeds_linear_range(applied, row, -mu):
            return BucklingResult(0.0, row, (0.0,) * len(applied))
        if -mu < shares_from:
            return BucklingResult(-mu, row, (0.0,) * len(applied))
        shares = [-float(x @ (_stiffness_change(structure, [load], row) @ x)) for load in applied]
        return BucklingResult(-mu, row, tuple(shares))

    def _exceeds_linear_range(self, applied: Sequence[AppliedLoad], row: int, part: float) -> bool:
        """Whether the loads deflect a body so much, before it buckles, that linear buckling does not apply.

        Linear buckling assumes that the body stays straight until then.
        """
        return (
            self.elastic.largest_displacement(_load(self.elastic, applied, row))
            > LARGE_BUCKLED_DEFLECTION * part * self.elastic.scale[1]
        )


def _lowest_eigenvalue(structure: Statics, applied: Sequence[AppliedLoad], row: int) -> tuple[float, Array]:
    """Lowest mu under the loads at an instant, and its shape."""
    constrained = _sum_at_markers(
        structure, applied, [np.diag(np.arange(6.0) < load.n_constrained) for load in applied]
    )
    return structure.lowest(_stiffness_change(structure, applied, row), constrained)


def _stiffness_change(structure: Statics, applied: Sequence[AppliedLoad], row: int) -> Any:
    """Geometric and load stiffness of the loads at an instant."""
    stress = structure.stress(_load(structure, applied, row))
    load_stiffness = _sum_at_markers(structure, applied, [load.load_stiffness(row) for load in applied])
    return stress if load_stiffness is None else stress - load_stiffness


def _load(structure: Statics, applied: Sequence[AppliedLoad], row: int) -> Array:
    """Generalised forces (n_load,) of the loads at an instant."""
    return np.asarray(np.sum([structure.loads(load.marker) @ load.values[row] for load in applied], axis=0))


def _sum_at_markers(structure: Statics, applied: Sequence[AppliedLoad], blocks: Sequence[Array]) -> Any | None:
    """Sum of matrices at the markers of the loads, (n, n); None for nothing."""
    total: Any | None = None
    for load, A in zip(applied, blocks, strict=True):
        if load.marker is not None and A.any():
            matrix = structure.marker_matrix(load.marker, A)
            total = matrix if total is None else total + matrix
    return total


def _is_active(load: AppliedLoad) -> bool:
    """Whether a load has a force or a constraint."""
    return bool(load.values.any() or load.n_constrained)
