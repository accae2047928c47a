"""Directions of the coordinate systems of decks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array


@dataclass(frozen=True, eq=False)
class Axes:
    """Rectangular (kind R), cylindrical (C) or spherical (S) axes: origin (3,) [m], and C (3, 3), rows the axes of the
    defining system, of which the third is the polar axis."""

    kind: str
    origin: Array
    C: Array

    def axes_at(self, point: Array) -> Array:
        """Directions (3, 3) at a point (3,) [m] in basic components, as rows: radial, around the axis, along it; of
        spherical axes radial, away from the polar axis, around it."""
        if self.kind == "R":
            return self.C
        x, y, z = self.C @ (point - self.origin)
        rho = np.hypot(x, y)
        if rho < 1e-9 * max(1e-3, abs(z)):  # on the axis the first axes are those of the defining system
            radial, around = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
        else:
            radial, around = np.array([x, y, 0]) / rho, np.array([-y, x, 0]) / rho
        if self.kind == "C":
            local = np.stack([radial, around, [0.0, 0, 1.0]])
        else:
            R = np.hypot(rho, z)
            sine, cosine = (rho / R, z / R) if R > 0 else (0.0, 1.0)
            local = np.stack([sine * radial + [0, 0, cosine], cosine * radial - [0, 0, sine], around])
        return np.asarray(local @ self.C)
