"""Markers: named points on a body, and their motion by its shapes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import Array
from femflex.summary import Rows, Summarised


@dataclass(frozen=True, eq=False, repr=False)
class Marker(Summarised):
    """A named point on a body, to which joints, loads and sensors attach.

    position    (3,)    undeformed position, body frame [m]
    phi         (3, n)  translation of the point per shape
    psi         (3, n)  small rotation of the point per shape
    orientation (3, 3)  C_BM: turns marker components into body components, undeformed
    axis        (3,)    unit vector along the beam whose section it is, where psi delta is (twist, sines of the slopes);
                        zero where psi delta is the rotation vector itself
    stretch     (3, 4, 3)  static displacement of the point by stretch that no coordinate describes, in fields z_a e_b
                        of force per mass on the body, z = (1, position) [s^2 | s^2 m]
    """

    position: Array
    phi: Array
    psi: Array
    orientation: Array = field(default_factory=lambda: np.eye(3))
    axis: Array = field(default_factory=lambda: np.zeros(3))
    stretch: Array = field(default_factory=lambda: np.zeros((3, 4, 3)))

    @classmethod
    def at_position(cls, position: Array, orientation: Array | None = None, n_modes: int = 0) -> Marker:
        """A marker at a position (3,) [m] with axes C_BM (3, 3) that does not move with the elastic coordinates."""
        zero = np.zeros((3, n_modes))
        return cls(np.asarray(position, float), zero, zero, np.eye(3) if orientation is None else orientation)

    def summary(self) -> tuple[str, Rows]:
        """Position, axes and number of shapes."""
        axes = [", ".join(f"{value:.6g}" for value in column + 0.0) for column in self.orientation.T]
        rows = [("position", ", ".join(f"{value:.6g}" for value in self.position + 0.0) + " m")]
        rows += [(f"axis {name}", text) for name, text in zip("xyz", axes, strict=True)]
        return "Marker", [*rows, ("shapes", str(self.phi.shape[1]))]

    @property
    def loads(self) -> Array:
        """Work (n, 6) of unit forces and moments at the point on the shapes, body axes."""
        return np.vstack([self.phi, self.psi]).T

    def rotation_vector(self, delta: Array) -> Array:
        """Rotation vector of the point (..., 3) at amplitudes delta (..., n) of all shapes.

        For a section whose axis e stays on the tangent, with s = psi delta and p = s - e (e.s), it is
        s - 1/2 (e.s) e x s + 1/6 |p|^2 p, correct to second order in all and to third in the slopes.
        """
        s = np.asarray(delta, float) @ self.psi.T
        if not self.axis.any():
            return s
        twist = s @ self.axis
        p = s - twist[..., None] * self.axis
        square = np.sum(p * p, axis=-1)[..., None]
        return np.asarray(s - 0.5 * twist[..., None] * np.cross(self.axis, s) + square / 6 * p)

    def with_orientation(self, orientation: Array) -> Marker:
        """The same point with other undeformed axes, C_BM (3, 3)."""
        return replace(self, orientation=np.asarray(orientation, float))
