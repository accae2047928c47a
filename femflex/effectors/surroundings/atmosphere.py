"""The upper air: density by an exponential table over height, and its motion with the turning Earth.

The table is that of D. A. Vallado, Fundamentals of Astrodynamics and Applications (4th ed., 2013), table 8-4: the US
Standard Atmosphere of 1976 up to 25 km and the reference atmosphere CIRA-72 above, for mean solar activity. Activity
alone changes the density at 500 km by a factor of up to ten either way: give `density_factor`.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np

from femflex.arrays import Array
from femflex.effectors.surroundings.earth import EARTH_RATE, FLATTENING, altitude_of
from femflex.effectors.surroundings.noun import Surrounding, around_earth
from femflex.kernels.vectors import load3, store3
from femflex.noun.values import Quantity
from femflex.system.acting import Context

# base height [km], density there [kg/m^3], scale height [km]
TABLE = np.array([
    (0, 1.225, 7.249), (25, 3.899e-2, 6.349), (30, 1.774e-2, 6.682), (40, 3.972e-3, 7.554), (50, 1.057e-3, 8.382),
    (60, 3.206e-4, 7.714), (70, 8.770e-5, 6.549), (80, 1.905e-5, 5.799), (90, 3.396e-6, 5.382),
    (100, 5.297e-7, 5.877), (110, 9.661e-8, 7.263), (120, 2.438e-8, 9.473), (130, 8.484e-9, 12.636),
    (140, 3.845e-9, 16.149), (150, 2.070e-9, 22.523), (180, 5.464e-10, 29.740), (200, 2.789e-10, 37.105),
    (250, 7.248e-11, 45.546), (300, 2.418e-11, 53.628), (350, 9.518e-12, 53.298), (400, 3.725e-12, 58.515),
    (450, 1.585e-12, 60.828), (500, 6.967e-13, 63.822), (600, 1.454e-13, 71.835), (700, 3.614e-14, 88.667),
    (800, 1.170e-14, 124.64), (900, 5.245e-15, 181.05), (1000, 3.019e-15, 268.00),
])  # fmt: skip
ROWS = len(TABLE)
GAS_CONSTANT = 8.31446261815324  # J/(mol K)
RADIUS, FACTOR, FIXED, RATE, TEMPERATURE, MOLAR_MASS, FIRST = 0, 1, 2, 3, 4, 5, 6  # of its parameters; then the table


def check_perigee(context: Context, lowest: float, highest: float, what: str) -> None:
    """Raise ValueError where the lowest height [m] on the orbit is outside those of a model of the air."""
    if (orbit := context.orbit) is None:
        return
    height = orbit.semi_major_axis * (1.0 - orbit.eccentricity) - context.radius
    if not lowest <= height <= highest:
        raise ValueError(
            f"the perigee is at a height of {height / 1e3:.4g} km, and {what} holds from {lowest / 1e3:g} to "
            f"{highest / 1e3:g} km; change the orbit, or give `density` of kind = 'atmosphere'"
        )


class Air(Surrounding):
    """The Earth's upper air at the craft.

    Channels: density; x, y, z, the velocity of the air in inertial axes; temperature; molar_mass.
    """

    density_factor: Annotated[float, Quantity(least=0.0)] = 1.0
    """Factor on the density of the model."""
    rotation: Annotated[float, Quantity(least=0.0)] = 1.0
    """Rate with which the air turns, over that of the Earth."""

    label = "atmosphere"
    channels = {"density": "kg/m^3", "x": "m/s", "y": "m/s", "z": "m/s", "temperature": "K", "molar_mass": "kg/mol"}


class Atmosphere(Air, heading="surroundings"):
    """The Earth's upper air, with a density over height alone."""

    kind: Literal["atmosphere"]
    """The Earth's upper air."""
    density: Annotated[float, Quantity("kg/m^3", least=0.0)] | None = None
    """Constant density, in place of that of the table over height."""
    temperature: Annotated[float, Quantity("K", above=0.0)] = 1000.0
    """Temperature of the air, which sets the speed of its molecules."""
    molar_mass: Annotated[float, Quantity("kg/mol", above=0.0)] = 0.016
    """Molar mass of the air; atomic oxygen prevails between 200 and 600 km."""

    def constants(self, name: str, context: Context) -> Array:
        """Radius [m], factor, fixed density, rate [rad/s], temperature, molar mass, and the table in SI.

        Raises ValueError for an orbit about another body, or above the table.
        """
        if self.density is None:
            around_earth(context, "the table of the atmosphere")
            check_perigee(context, 0.0, 1e3 * TABLE[-1, 0], "the table of the atmosphere")
        fixed = -1.0 if self.density is None else self.density
        rate = self.rotation * EARTH_RATE
        head = [context.radius, self.density_factor, fixed, rate, self.temperature, self.molar_mass]
        return np.concatenate([head, (TABLE * [1e3, 1.0, 1e3]).ravel()])


@Atmosphere.kernel
def atmosphere(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: place and velocity on the orbit. Above the table the density goes on falling with its last height."""
    p = parameters
    place = load3(seen, 0)
    density = p[FIXED]
    if density < 0.0:
        height = altitude_of(place[0], place[1], place[2], p[RADIUS], FLATTENING)
        row = 0
        for k in range(1, ROWS):
            if p[FIRST + 3 * k] <= height:
                row = k
        k = FIRST + 3 * row
        density = p[FACTOR] * p[k + 1] * math.exp(-(max(height, 0.0) - p[k]) / p[k + 2])
    out[0] = density
    store3(out, 1, (-p[RATE] * place[1], p[RATE] * place[0], 0.0))
    out[4], out[5] = p[TEMPERATURE], p[MOLAR_MASS]
    out[6] = out[7] = out[8] = out[9] = 0.0
