"""Loads on a body along a motion, one by one, and the interface of its linear buckling analysis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from femflex.arrays import Array
from femflex.fem.connections.connection import skew

FIELD = 12  # values of a field: b (3), then W by its columns (9)
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
    inertia  (6, 6) of the bodies attached there, which move with the marker [kg, kg m, kg m^2]
    """

    name: str
    marker: str | None
    values: Array
    wrench: Array
    arm: Array = field(default_factory=lambda: np.zeros((1, 3)))
    follows: bool = False
    n_constrained: int = 0
    inertia: Array = field(default_factory=lambda: np.zeros((6, 6)))

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


class BucklingModel(Protocol):
    """Linear buckling analysis of a body."""

    def worst_instant(self, loads: Sequence[AppliedLoad], shares_from: float = 0.0) -> BucklingResult:
        """Largest load over buckling load of all loads together, over their instants.

        shares_from: ratio above which the share of each load is computed.
        """

    def reduced_ratio(self, loads: Sequence[AppliedLoad], row: int) -> float:
        """Load over buckling load in the reduced basis, at one instant; follower loads count as dead loads."""
