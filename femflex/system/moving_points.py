"""Points of mass of a member whose mass moves, for fields that are not linear in position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array


@dataclass(frozen=True, eq=False)
class MovingPoints:
    """Points that follow a length L, over the coordinates delta of the member's shapes.

    A point has the mass mass + density L at r = base + (along L) direction + (phi + phi_inverse / L) delta. The
    material there moves, per rate of the length, with drawn direction + (drift / L + drift_inverse / L^2) delta.

    direction                (3,)       of the member
    mass, density            (p,)       [kg], [kg/m]
    base                     (p, 3)     [m]
    along, drawn             (p,)       [1]
    phi, drift               (p, 3, n)  [m per coordinate]
    phi_inverse, drift_inverse (p, 3, n)  [m^2 per coordinate]
    """

    direction: Array
    mass: Array
    density: Array
    base: Array
    along: Array
    drawn: Array
    phi: Array
    phi_inverse: Array
    drift: Array
    drift_inverse: Array

    @property
    def numbers(self) -> Array:
        """Per point mass, density, base (3), along, drawn, 0: (p, 8)."""
        ends = [self.along, self.drawn, np.zeros(len(self.mass))]
        return np.column_stack([self.mass, self.density, self.base, *ends])

    @property
    def tables(self) -> Array:
        """phi, phi_inverse, drift and drift_inverse per point: (p, 4, 3, n)."""
        return np.stack([self.phi, self.phi_inverse, self.drift, self.drift_inverse], axis=1)
