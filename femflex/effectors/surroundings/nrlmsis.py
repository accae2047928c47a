"""The upper air by NRLMSIS, the empirical model of the US Naval Research Laboratory, through the package pymsis.

J. M. Picone et al., NRLMSISE-00, Journal of Geophysical Research 107 (2002), which is free to use; J. T. Emmert et al.,
NRLMSIS 2.0, Earth and Space Science 8 (2021), and 2.1, Journal of Geophysical Research: Space Physics 127 (2022), whose
licence asks NRL's consent for commercial use. The model takes microseconds a place and is not compiled here: before a
run, the logarithm of its density, its temperature and its mean molar mass are tabulated over universal time, local
solar time, latitude and height for the day of the epoch, and the run interpolates them by cubics that continue their
slopes (Catmull and Rom).
Between 110 and 990 km this is within 0.1 % of the model (rms; 0.8 % at most), with 8 x 24 x 19 x 54 places.

The day of the year and the indices of solar and geomagnetic activity stay those of the epoch: over a month the model's
own annual terms change the density by up to some 15 %.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np

from femflex.arrays import Array
from femflex.effectors.surroundings.atmosphere import GAS_CONSTANT, Air, check_perigee
from femflex.effectors.surroundings.earth import DAY, EARTH_RATE, FLATTENING, altitude_of, sidereal_angle
from femflex.effectors.surroundings.noun import around_earth, epoch_of
from femflex.extras import require
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import load3, store3
from femflex.noun.values import Quantity
from femflex.system.acting import Context
from femflex.system.environment import STANDARD_GRAVITY

AVOGADRO = 6.02214076e23  # 1/mol
SIZES = (8, 24, 19, 56)  # places over universal time, local solar time, latitude and height
LOWEST, HIGHEST, FOOT = 100e3, 2500e3, 60e3  # m: second and last but one height, equidistant in log(height - FOOT)
LOG_STEP = math.log((HIGHEST - FOOT) / (LOWEST - FOOT)) / (SIZES[3] - 3)
RADIUS, FACTOR, RATE, EPOCH, SIDEREAL, FIRST = 0, 1, 2, 3, 4, 5  # of its parameters; then the table


class Nrlmsis(Air, heading="surroundings"):
    """The Earth's upper air by the empirical model NRLMSIS; needs the package pymsis and the epoch."""

    kind: Literal["nrlmsis"]
    """The Earth's upper air by NRLMSIS."""
    version: Literal["00", "2.0", "2.1"] = "00"
    """Version of the model: NRLMSISE-00, or NRLMSIS 2.0 or 2.1, whose licence restricts commercial use."""
    f107: Annotated[float, Quantity(least=40.0, most=500.0)]
    """Flux of the sun at 10.7 cm on the day before the epoch, in 1e-22 W/(m^2 Hz)."""
    f107_mean: Annotated[float, Quantity(least=40.0, most=500.0)]
    """Mean of that flux over the 81 days around the epoch."""
    ap: Annotated[float, Quantity(least=0.0, most=400.0)]
    """Geomagnetic index Ap of the day."""

    def constants(self, name: str, context: Context) -> Array:
        """Radius [m], factor, rate [rad/s], days since J2000, sidereal angle then, and the table.

        Raises ValueError without epoch or pymsis, for an orbit about another body or outside the table, and for indices
        for which the model has no density.
        """
        epoch = epoch_of(context, "the atmosphere by NRLMSIS")
        around_earth(context, "NRLMSIS")
        check_perigee(context, LOWEST, HIGHEST, "NRLMSIS")
        head = [context.radius, self.density_factor, self.rotation * EARTH_RATE, epoch, sidereal_angle(epoch)]
        return np.concatenate([head, self._table(epoch)])

    def _table(self, epoch: float) -> Array:
        """Log density, temperature and molar mass, over universal time, local time, latitude and height, flat."""
        hours = [np.arange(n) * (24.0 / n) for n in SIZES[:2]]
        latitudes = np.linspace(-90.0, 90.0, SIZES[2])
        heights = FOOT + (LOWEST - FOOT) * np.exp(LOG_STEP * (np.arange(SIZES[3]) - 1.0))
        grid = np.meshgrid(*hours, latitudes, heights, indexing="ij")
        universal, local, latitude, height = (values.ravel() for values in grid)
        longitude = (15.0 * (local - universal) + 180.0) % 360.0 - 180.0
        midnight = np.datetime64("2000-01-01", "s") + np.timedelta64(math.floor(epoch + 0.5), "D")
        dates = midnight + (3600.0 * universal).astype("timedelta64[s]")
        indices = (np.full(len(dates), value) for value in (self.f107, self.f107_mean))
        activity = np.full((len(dates), 7), self.ap)
        air = pymsis_module().calculate(
            dates, longitude, latitude, 1e-3 * height, *indices, activity, version=self.version
        )
        density, particles = np.asarray(air[:, 0], float), np.nansum(air[:, 1:10], axis=1, dtype=float)
        if not (np.isfinite(density).all() and density.min() > 0.0 and np.isfinite(air[:, 10]).all()):
            raise ValueError(
                f"NRLMSIS has no density for f107 = {self.f107:g}, f107_mean = {self.f107_mean:g} and ap = {self.ap:g}"
                "; give indices of a real day"
            )
        return np.stack([np.log(density), air[:, 10], AVOGADRO * density / particles], axis=1).ravel()


def pymsis_module() -> Any:
    """The package pymsis. Raises MissingExtra."""
    require("air", "densities by NRLMSIS")
    import pymsis

    return pymsis


@inner
def cubic_weight(k: int, x: float) -> float:
    """Weight of place k - 1 in 0 to 3, for interpolation at x in 0 to 1 between places 0 and 1."""
    if k == 0:
        return x * (-0.5 + x * (1.0 - 0.5 * x))
    if k == 1:
        return 1.0 + x * x * (-2.5 + 1.5 * x)
    if k == 2:
        return x * (0.5 + x * (2.0 - 1.5 * x))
    return x * x * (-0.5 + 0.5 * x)


@inner
def row_of(i: int, j: int, latitude: int) -> int:
    """Row of the lowest height; times are periodic, and beyond a pole latitudes return on the other side."""
    if latitude < 0 or latitude >= SIZES[2]:
        latitude = -latitude if latitude < 0 else 2 * (SIZES[2] - 1) - latitude
        j += SIZES[1] // 2
    return ((i % SIZES[0] * SIZES[1] + j % SIZES[1]) * SIZES[2] + latitude) * SIZES[3]


@Nrlmsis.kernel
def nrlmsis(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: place and velocity on the orbit. Outside the heights of the table the air is isothermal."""
    p = parameters
    place = load3(seen, 0)
    height = altitude_of(place[0], place[1], place[2], p[RADIUS], FLATTENING)
    inside = min(max(height, LOWEST), HIGHEST)
    e2, level = FLATTENING * (2.0 - FLATTENING), math.sqrt(place[0] ** 2 + place[1] ** 2)
    latitude = math.atan2(place[2] * (p[RADIUS] + height), level * (p[RADIUS] * (1.0 - e2) + height))
    universal = (p[EPOCH] + t / DAY + 0.5) % 1.0
    longitude = math.atan2(place[1], place[0]) - p[SIDEREAL] - EARTH_RATE * t
    local = (universal + longitude / (2.0 * math.pi)) % 1.0
    a, b, c = universal * SIZES[0], local * SIZES[1], (latitude / math.pi + 0.5) * (SIZES[2] - 1)
    d = 1.0 + math.log((inside - FOOT) / (LOWEST - FOOT)) / LOG_STEP
    i, j, k, m = int(a), int(b), min(int(c), SIZES[2] - 2), min(int(d), SIZES[3] - 3)
    logarithm = temperature = mass = 0.0
    for e in range(4):
        for f in range(4):
            at_time = cubic_weight(e, a - i) * cubic_weight(f, b - j)
            for g in range(4):
                weight = at_time * cubic_weight(g, c - k)
                row = FIRST + 3 * (row_of(i - 1 + e, j - 1 + f, k - 1 + g) + m - 1)
                for h in range(4):
                    part = weight * cubic_weight(h, d - m)
                    logarithm += part * p[row + 3 * h]
                    temperature += part * p[row + 3 * h + 1]
                    mass += part * p[row + 3 * h + 2]
    if height != inside:
        gravity = STANDARD_GRAVITY * (p[RADIUS] / (p[RADIUS] + inside)) ** 2
        logarithm -= (height - inside) * mass * gravity / (GAS_CONSTANT * temperature)
    out[0] = p[FACTOR] * math.exp(logarithm)
    store3(out, 1, (-p[RATE] * place[1], p[RATE] * place[0], 0.0))
    out[4], out[5] = temperature, mass
    out[6] = out[7] = out[8] = out[9] = 0.0
