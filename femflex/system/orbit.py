"""Kepler orbits, also with elements that drift, and the base frame from which the root body's attitude is measured.

Orbital frame at O: x0 along the orbit normal, y0 along the outward vertical, z0 along the flight direction (THEORY
section 1). Inertial axes: perifocal when the three orientation angles are zero: X towards perigee, Z the orbit normal.
With a node that drifts the velocity leaves the plane of the elements by r node_rate sin i, 2e-4 of it in low orbit; the
orbital frame follows the plane.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import PrivateAttr, StrictBool, model_validator

from femflex.arrays import Array
from femflex.noun.table import Table, exactly_one, refuse
from femflex.noun.values import Angle, Fraction, Length, PositiveLength, Quantity, Rate
from femflex.rotations import dcm_from_angles
from femflex.system.profile import Profile

MU_EARTH = 3.986004418e14  # m^3/s^2
EARTH_RADIUS = 6378137.0  # m, equatorial, over which altitudes are counted

ORBIT_SIGNALS = tuple(f"orbit.{what}_{axis}" for what in ("position", "velocity") for axis in "xyz")  # of O, inertial
CRAFT_SIGNALS = tuple(f"craft.{what}_{axis}" for what in ("position", "velocity") for axis in "xyz")  # of the root body
CIRCULAR = 1e-9  # eccentricity below which an orbit counts as circular
FRAMES = ("inertial", "orbital", "spinning")


class Orbit(Table):
    """A Kepler orbit, or one that drifts.

    Orbital frame: x0 along the orbit normal, y0 outward vertical, z0 in flight direction.
    """

    kind: Literal["none", "specified", "free"] = "specified"
    """none; specified: the centre of mass stays on the ellipse; free: its motion is solved for."""
    semi_major_axis: PositiveLength = None  # type: ignore[assignment]
    """Semi-major axis, in place of perigee_altitude."""
    eccentricity: Fraction = 0.0
    """Eccentricity of the ellipse."""
    inclination: Angle = 0.0
    """Inclination to the equator."""
    node: Angle = 0.0
    """Right ascension of the ascending node."""
    perigee: Angle = 0.0
    """Argument of the perigee."""
    true_anomaly: Angle = 0.0
    """True anomaly at t = 0; 0 is the perigee."""
    mu: Annotated[float, Quantity("m^3/s^2", above=0.0)] = MU_EARTH
    """Gravitational parameter of the central body. Default: the Earth's."""
    perigee_altitude: Length | None = None
    """Height of the perigee above `radius`."""
    radius: PositiveLength = EARTH_RADIUS
    """Radius from which altitudes are measured. Default: the Earth's equatorial radius."""
    secular_rates: StrictBool = False
    """Whether node, perigee and mean anomaly of a specified orbit drift as J2 (environment.oblateness) makes them drift
    on average."""
    node_rate: Rate = 0.0
    """Uniform drift of the node of a specified orbit."""
    perigee_rate: Rate = 0.0
    """Uniform drift of the perigee of a specified orbit."""
    anomaly_rate: Rate = 0.0
    """Uniform drift of the mean anomaly of a specified orbit, in addition to the mean motion."""
    ephemeris: str | None = None
    """File in place of the elements, relative to the case file: an OEM of CCSDS, or two-line elements (sgp4). A
    specified orbit follows its positions; a free one starts with its position and velocity. t = 0 is environment.epoch,
    by default the first epoch of the file."""

    _path: tuple[Profile, Profile, Profile] | None = PrivateAttr(default=None)

    @classmethod
    def from_python(cls, keys: dict[str, Any]) -> dict[str, Any]:
        """In Python `free` says whether the translation of the centre of mass is solved for."""
        free = keys.pop("free", None)
        return keys if free is None else {**keys, "kind": "free" if free else "specified"}

    @model_validator(mode="after")
    def _one_size(self) -> Orbit:
        if self.kind == "none":
            if other_keys := sorted(self.model_fields_set - {"kind"}):
                refuse(
                    f"found kind = 'none' together with {', '.join(other_keys)}; an orbit has kind 'specified' "
                    "or 'free'"
                )
            return self
        if self.free and (self.secular_rates or self.drifts):
            rates = [self.node_rate, self.perigee_rate, self.anomaly_rate]
            found = (
                "secular_rates = true" if self.secular_rates else f"rates {rates} rad/s of node, perigee and anomaly"
            )
            refuse(
                f"found {found} with kind = 'free'; a free orbit drifts by the forces that act on it: leave them out, "
                "or set kind = 'specified'"
            )
        if self.secular_rates and self.drifts:
            refuse("found secular_rates and rates of node, perigee or anomaly; give one or the other")
        if self.ephemeris is not None and (self.secular_rates or self.drifts):
            refuse("found ephemeris and rates of the elements; an ephemeris has its drift already, so leave them out")
        exactly_one(self, ("perigee_altitude", "semi_major_axis"))
        if self.perigee_altitude is not None:
            vars(self)["semi_major_axis"] = (self.radius + self.perigee_altitude) / (1.0 - self.eccentricity)
        return self

    def with_secular_rates(self, J2: float, radius: float) -> Orbit:
        """The orbit whose node, perigee and mean anomaly drift as they do on average under J2 (Vallado, section 9.6).

        With k = 3/2 n J2 (R_e/p)^2:  node -k cos i,  perigee k/2 (5 cos^2 i - 1),  mean anomaly k/2 sqrt(1 - e^2)
        (3 cos^2 i - 1), to the first order of J2; the elements are mean ones. radius: R_e [m]
        """
        squeeze, c = 1.0 - self.eccentricity**2, np.cos(self.inclination)
        k = 1.5 * self.mean_motion * J2 * (radius / (self.semi_major_axis * squeeze)) ** 2
        rates = {
            "node_rate": float(-k * c),
            "perigee_rate": float(0.5 * k * (5.0 * c * c - 1.0)),
            "anomaly_rate": float(0.5 * k * np.sqrt(squeeze) * (3.0 * c * c - 1.0)),
        }
        return self.model_copy(update=rates)

    def along_path(self, path: tuple[Profile, Profile, Profile]) -> Orbit:
        """The specified orbit whose O goes along inertial components of a position [m]; elements are those at t = 0."""
        orbit = self.model_copy()
        orbit._path = path
        return orbit

    @property
    def path(self) -> tuple[Profile, Profile, Profile] | None:
        """Inertial components [m] of the position of O, of an orbit that follows an ephemeris."""
        return self._path

    @property
    def free(self) -> bool:
        """Whether the translation of the centre of mass is solved for."""
        return self.kind == "free"

    @property
    def perigee_radius(self) -> float:
        """Distance of the perigee from the centre [m]."""
        return self.semi_major_axis * (1.0 - self.eccentricity)

    @property
    def drifts(self) -> bool:
        """Whether its elements change over time."""
        return (self.node_rate, self.perigee_rate, self.anomaly_rate) != (0.0, 0.0, 0.0)

    @property
    def is_steady(self) -> bool:
        """Whether its radius and the rate of its orbital frame, in that frame, are constant."""
        return (
            self.path is None
            and self.eccentricity <= CIRCULAR
            and (self.node_rate == 0.0 or np.sin(self.inclination) == 0.0)
        )

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
