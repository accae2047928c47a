"""The turning Earth: sidereal time, rate and figure."""

from __future__ import annotations

import math

from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Vector

EARTH_RATE = 7.292115e-5  # rad/s, inertial (WGS 84)
FLATTENING = 1 / 298.257223563  # WGS 84
DAY = 86400.0  # s
REFERENCE_RADIUS = 6371200.0  # m, of the geomagnetic field


def sidereal_angle(days: float) -> float:
    """Greenwich mean sidereal time [rad] at days since J2000 (2000-01-01, 12:00), here of UT1.

    The expression of 1982 of the International Astronomical Union (Explanatory Supplement to the Astronomical Almanac).
    """
    T = days / 36525.0
    seconds = 67310.54841 + (876600.0 * 3600.0 + 8640184.812866) * T + 0.093104 * T * T - 6.2e-6 * T**3
    return math.fmod(seconds / DAY * 2.0 * math.pi, 2.0 * math.pi)


@inner
def altitude_of(x: float, y: float, z: float, radius: float, flattening: float) -> float:
    """Height [m] over an ellipsoid: along the radius, with the ellipsoid's radius at the geocentric latitude.

    It differs from the geodetic height by less than 40 m up to 2000 km.
    """
    r = math.sqrt(x * x + y * y + z * z)
    sine = z / r
    squeeze = 1.0 - flattening
    return r - radius * squeeze / math.sqrt(squeeze * squeeze + (1.0 - squeeze * squeeze) * sine * sine)


@inner
def turned_z(v: Vector, angle: float) -> Vector:
    """A vector turned about the third axis by an angle."""
    c, s = math.cos(angle), math.sin(angle)
    return c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]


@inner
def ecliptic_to_equator(v: Vector, days: float) -> Vector:
    """A vector from axes of the ecliptic in those of the mean equator of date, at days since J2000."""
    obliquity = (23.439 - 0.00000036 * days) * math.pi / 180.0
    c, s = math.cos(obliquity), math.sin(obliquity)
    return v[0], c * v[1] - s * v[2], s * v[1] + c * v[2]
