"""Kepler orbits, also with elements that drift, and the base frame from which the root body's attitude is measured.

Orbital frame at O: x0 along the orbit normal, y0 along the outward vertical, z0 along the flight direction (THEORY
section 1). Inertial axes: perifocal when the three orientation angles are zero: X towards perigee, Z the orbit normal.
With a node that drifts the velocity leaves the plane of the elements by r node_rate sin i, 2e-4 of it in low orbit; the
orbital frame follows the plane.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import Array
from femflex.rotations import dcm_from_angles

MU_EARTH = 3.986004418e14  # m^3/s^2
EARTH_RADIUS = 6378137.0  # m, equatorial, over which altitudes are counted

ORBIT_SIGNALS = tuple(f"orbit.{what}_{axis}" for what in ("position", "velocity") for axis in "xyz")  # of O, inertial
CRAFT_SIGNALS = tuple(f"craft.{what}_{axis}" for what in ("position", "velocity") for axis in "xyz")  # of the root body
CIRCULAR = 1e-9  # eccentricity below which an orbit counts as circular
FRAMES = ("inertial", "orbital", "spinning")


@dataclass(frozen=True)
class Orbit:
    """A Kepler orbit of the reference point O.

    semi_major_axis [m], eccentricity [0, 1), inclination, node (right ascension), perigee (argument) [rad],
    true_anomaly at t = 0 [rad], mu [m^3/s^2].
    free: False keeps O on the ellipse (specified orbit); True solves for the translation of the centre of mass.
    node_rate, perigee_rate, anomaly_rate: uniform drift of node, perigee and mean anomaly of a specified orbit [rad/s].
    """

    semi_major_axis: float
    eccentricity: float = 0.0
    inclination: float = 0.0
    node: float = 0.0
    perigee: float = 0.0
    true_anomaly: float = 0.0
    mu: float = MU_EARTH
    free: bool = False
    node_rate: float = 0.0
    perigee_rate: float = 0.0
    anomaly_rate: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.eccentricity < 1:
            raise ValueError(f"eccentricity is {self.eccentricity}; a Kepler ellipse has 0 <= e < 1")
        if not self.semi_major_axis > 0 or not self.mu > 0:
            raise ValueError(f"semi-major axis {self.semi_major_axis} m and mu {self.mu} m^3/s^2 must both be positive")
        if self.free and self.drifts:
            raise ValueError(
                f"a free orbit has node, perigee and anomaly rates of {self.node_rate:g}, {self.perigee_rate:g} and "
                f"{self.anomaly_rate:g} rad/s; it drifts by the forces that act on it: leave them out, or specify it"
            )

    @classmethod
    def from_perigee(
        cls, altitude: float, eccentricity: float = 0.0, radius: float = EARTH_RADIUS, **more: float
    ) -> Orbit:
        """The orbit with that perigee altitude [m] over a body of that radius [m]."""
        return cls((radius + altitude) / (1.0 - eccentricity), eccentricity, **more)  # type: ignore[arg-type]

    def with_secular_rates(self, J2: float, radius: float) -> Orbit:
        """The orbit whose node, perigee and mean anomaly drift as they do on average under J2 (Vallado, section 9.6).

        With k = 3/2 n J2 (R_e/p)^2:  node -k cos i,  perigee k/2 (5 cos^2 i - 1),  mean anomaly k/2 sqrt(1 - e^2)
        (3 cos^2 i - 1), to the first order of J2; the elements are mean ones. radius: R_e [m]
        """
        squeeze, c = 1.0 - self.eccentricity**2, np.cos(self.inclination)
        k = 1.5 * self.mean_motion * J2 * (radius / (self.semi_major_axis * squeeze)) ** 2
        return replace(
            self,
            node_rate=float(-k * c),
            perigee_rate=float(0.5 * k * (5.0 * c * c - 1.0)),
            anomaly_rate=float(0.5 * k * np.sqrt(squeeze) * (3.0 * c * c - 1.0)),
        )

    @property
    def drifts(self) -> bool:
        """Whether its elements change over time."""
        return (self.node_rate, self.perigee_rate, self.anomaly_rate) != (0.0, 0.0, 0.0)

    @property
    def is_steady(self) -> bool:
        """Whether its radius and the rate of its orbital frame, in that frame, are constant."""
        return self.eccentricity <= CIRCULAR and (self.node_rate == 0.0 or np.sin(self.inclination) == 0.0)

    @property
    def mean_motion(self) -> float:
        """n = sqrt(mu / a^3) [rad/s], without a drift of the mean anomaly."""
        return float(np.sqrt(self.mu / self.semi_major_axis**3))

    @property
    def period(self) -> float:
        """2 pi / n [s]."""
        return 2.0 * np.pi / self.mean_motion

    def C_NP(self) -> Array:
        """Turns perifocal components (X to perigee, Z normal) into inertial ones at t = 0, (3, 3)."""
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
