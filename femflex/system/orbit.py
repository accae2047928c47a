"""Kepler orbits, and the base frame from which the root body's attitude is measured.

Orbital frame at O: x0 along the orbit normal, y0 along the outward vertical, z0 along the flight direction (THEORY
section 1). Inertial axes: perifocal when the three orientation angles are zero: X towards perigee, Z the orbit normal.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array
from femflex.rotations import dcm_from_angles

MU_EARTH = 3.986004418e14  # m^3/s^2
EARTH_RADIUS = 6378137.0  # m, equatorial, over which altitudes are counted

ORBIT_SIGNALS = tuple(f"orbit.{what}_{axis}" for what in ("position", "velocity") for axis in "xyz")  # of O, inertial
FRAMES = ("inertial", "orbital", "spinning")


@dataclass(frozen=True)
class Orbit:
    """A Kepler orbit of the reference point O.

    semi_major_axis [m], eccentricity [0, 1), inclination, node (right ascension), perigee (argument) [rad],
    true_anomaly at t = 0 [rad], mu [m^3/s^2].
    free: False keeps O on the ellipse (specified orbit); True solves for the translation of the centre of mass.
    """

    semi_major_axis: float
    eccentricity: float = 0.0
    inclination: float = 0.0
    node: float = 0.0
    perigee: float = 0.0
    true_anomaly: float = 0.0
    mu: float = MU_EARTH
    free: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.eccentricity < 1:
            raise ValueError(f"eccentricity is {self.eccentricity}; a Kepler ellipse has 0 <= e < 1")
        if not self.semi_major_axis > 0 or not self.mu > 0:
            raise ValueError(f"semi-major axis {self.semi_major_axis} m and mu {self.mu} m^3/s^2 must both be positive")

    @classmethod
    def from_perigee(
        cls, altitude: float, eccentricity: float = 0.0, radius: float = EARTH_RADIUS, **more: float
    ) -> Orbit:
        """The orbit with that perigee altitude [m] over a body of that radius [m]."""
        return cls((radius + altitude) / (1.0 - eccentricity), eccentricity, **more)  # type: ignore[arg-type]

    @property
    def mean_motion(self) -> float:
        """n = sqrt(mu / a^3) [rad/s]."""
        return float(np.sqrt(self.mu / self.semi_major_axis**3))

    @property
    def period(self) -> float:
        """2 pi / n [s]."""
        return 2.0 * np.pi / self.mean_motion

    def C_NP(self) -> Array:
        """Turns perifocal components (X to perigee, Z normal) into inertial ones, (3, 3)."""
        return dcm_from_angles([self.node, self.inclination, self.perigee], "zxz")


@dataclass(frozen=True, eq=False)
class Frame:
    """The base frame F, from which joints with no parent lead: "inertial", "orbital", or "spinning" uniformly.

    rate (3,) angular rate of a spinning frame, inertial (= frame, at t = 0) components [rad/s].
    """

    kind: str = "inertial"
    rate: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        if self.kind not in FRAMES:
            raise ValueError(f"frame {self.kind!r} is not known; known are {list(FRAMES)}")
