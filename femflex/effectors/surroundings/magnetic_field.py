"""The geomagnetic field: spherical harmonics of the IGRF, or its tilted dipole, at the place of the craft.

    V = a sum_n (a/r)^(n+1) sum_m (g_nm cos m phi + h_nm sin m phi) P_nm(cos theta),    B = -grad V

with Schmidt semi-normalised P_nm by the usual recursion over n (Langel 1987), in axes that turn with the Earth. The
coefficients are linear between the five-year epochs of their file, and constant during a run.
"""

from __future__ import annotations

import math
from functools import cache
from importlib.resources import files
from typing import Annotated, Literal

import numpy as np

from femflex.arrays import Array
from femflex.effectors.surroundings.earth import EARTH_RATE, REFERENCE_RADIUS, sidereal_angle, turned_z
from femflex.effectors.surroundings.noun import Surrounding, around_earth, epoch_of
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Vector, load3, store3
from femflex.noun.values import Count
from femflex.system.acting import Context

HIGHEST = 13  # degree of the coefficients
ANGLE, DEGREE, TABLE = 0, 1, 2  # of its parameters: sidereal angle at t = 0; g and h by degree and order


class MagneticField(Surrounding, heading="surroundings"):
    """The Earth's magnetic field at the craft: the IGRF of the environment's epoch.

    Channels: x, y, z, the flux density in inertial axes.
    """

    kind: Literal["magnetic_field"]
    """The Earth's magnetic field."""
    degree: Annotated[int, Count(1, HIGHEST)] = HIGHEST
    """Highest degree of the spherical harmonics; 1 is the tilted dipole."""

    label = "magnetic field"
    years = (1990.0, 2030.0)
    channels = {"x": "T", "y": "T", "z": "T"}

    def constants(self, name: str, context: Context) -> Array:
        """Sidereal angle [rad], degree, and coefficients [T]. Raises ValueError for a date outside these."""
        around_earth(context, "the magnetic field")
        days = epoch_of(context, "the magnetic field")
        g, h = coefficients(2000.0 + days / 365.25, self.degree)
        return np.concatenate([[sidereal_angle(days), float(self.degree)], np.stack([g, h], axis=2).ravel()])


@cache
def _table() -> tuple[Array, Array, Array]:
    """Degrees and orders (k, 2), years (y,) and coefficients (k, y) [nT] of the file."""
    text = files(__package__).joinpath("igrf14.csv").read_text(encoding="ascii")
    rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
    values = np.array(rows[1:], float)
    return values[:, :2].astype(int), np.array(rows[0][2:], float), values[:, 2:]


def coefficients(year: float, degree: int = HIGHEST) -> tuple[Array, Array]:
    """Gauss coefficients g and h (degree + 1, degree + 1) [T] of a year. Raises ValueError outside the file's years."""
    orders, years, values = _table()
    if not years[0] <= year <= years[-1]:
        raise ValueError(
            f"found the year {year:.1f}; the coefficients of the magnetic field (IGRF-14) hold from {years[0]:g} to "
            f"{years[-1]:g}"
        )
    g, h = np.zeros((2, degree + 1, degree + 1))
    for (n, m), row in zip(orders, values, strict=True):
        if n <= degree:
            (g if m >= 0 else h)[n, abs(m)] = 1e-9 * np.interp(year, years, row)
    return g, h


@inner
def field_in_earth_axes(r: Vector, degree: int, p: Array, table: int) -> Vector:
    """Flux density [T] at a place [m], both in axes that turn with the Earth; p[table:]: (g, h) by degree and order.

    The derivative of P_nm by theta comes from the same recursion; on the axis the eastern component is the limit.
    """
    level = math.sqrt(r[0] * r[0] + r[1] * r[1])
    radius = math.sqrt(level * level + r[2] * r[2])
    c, s = r[2] / radius, max(level / radius, 1e-10)
    cos_phi, sin_phi = (r[0] / level, r[1] / level) if level > 0.0 else (1.0, 0.0)
    ratio = REFERENCE_RADIUS / radius
    up, south, east = 0.0, 0.0, 0.0
    width = degree + 1
    P_mm, dP_mm, cos_m, sin_m = 1.0, 0.0, 1.0, 0.0
    for m in range(width):
        if m > 0:
            factor = 1.0 if m == 1 else math.sqrt((2.0 * m - 1.0) / (2.0 * m))
            P_mm, dP_mm = factor * s * P_mm, factor * (c * P_mm + s * dP_mm)
            cos_m, sin_m = cos_m * cos_phi - sin_m * sin_phi, sin_m * cos_phi + cos_m * sin_phi
        before, dbefore, P, dP = 0.0, 0.0, P_mm, dP_mm
        for n in range(m, width):
            if n > m:
                low = math.sqrt((n - 1.0) * (n - 1.0) - m * m)
                high = math.sqrt(1.0 * n * n - m * m)
                P, before, dP, dbefore = (
                    ((2.0 * n - 1.0) * c * P - low * before) / high,
                    P,
                    ((2.0 * n - 1.0) * (c * dP - s * P) - low * dbefore) / high,
                    dP,
                )
            if n > 0:
                k = table + 2 * (n * width + m)
                g, h = p[k], p[k + 1]
                scale_n = ratio ** (n + 2)
                along = g * cos_m + h * sin_m
                up += (n + 1.0) * scale_n * along * P
                south -= scale_n * along * dP
                east += scale_n * m * (g * sin_m - h * cos_m) * P / s
    outward = s * up + c * south
    return outward * cos_phi - east * sin_phi, outward * sin_phi + east * cos_phi, c * up - s * south


@MagneticField.kernel
def magnetic_field(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: place and velocity on the orbit."""
    angle = parameters[ANGLE] + EARTH_RATE * t
    place = turned_z(load3(seen, 0), -angle)
    store3(out, 0, turned_z(field_in_earth_axes(place, int(parameters[DEGREE]), parameters, TABLE), angle))
    out[3] = out[4] = out[5] = out[6] = 0.0
