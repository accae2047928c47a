"""The sun: its direction and distance, the share of its disc that the Earth leaves visible, and its light pressure.

Direction and distance are those of the Astronomical Almanac (section C, low precision): 0.01 deg between 1950 and 2050.
The eclipse is conical: with a = asin(R_sun / d) and b = asin(R_earth / r), the angular radii of sun and Earth as seen
from the craft, and c the angle between their centres, the visible share is one minus that of the overlap of two discs.
It goes smoothly from 1 through the penumbra to 0; discs are taken as flat, an error of 1e-3 of the share in low orbit.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import StrictBool, model_validator

from femflex.arrays import Array
from femflex.effectors.noun import unit_direction
from femflex.effectors.surroundings.earth import DAY, ecliptic_to_equator
from femflex.effectors.surroundings.noun import Surrounding, around_earth, epoch_of
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Vector, add, cross, dot, load3, scale, store3, sub
from femflex.noun.table import refuse
from femflex.noun.values import Direction
from femflex.system.acting import Context
from femflex.system.environment import SERIES_YEARS, within_series

AU = 1.495978707e11  # m, International Astronomical Union 2012
SUN_RADIUS = 6.957e8  # m, nominal, International Astronomical Union 2015
SPEED_OF_LIGHT = 299792458.0  # m/s
LIGHT_PRESSURE = 1361.0 / SPEED_OF_LIGHT  # Pa at 1 au: 1361 W/m^2 (nominal, International Astronomical Union 2015)

DATE, INERTIAL, ORBITAL = 0, 1, 2
SOURCE, HAS_ORBIT, ECLIPSE, RADIUS, EPOCH, FIXED = 0, 1, 2, 3, 4, 5  # of its parameters; FIXED: a direction (3)


class Sun(Surrounding, heading="surroundings"):
    """The sun, from the date of the environment's epoch, or in a fixed direction at 1 au.

    Channels: x, y, z, the unit vector to the sun in inertial axes; distance; visible, the share of its disc that the
    Earth leaves visible; pressure, that of its light on a black surface across it.
    """

    kind: Literal["sun"]
    """The sun."""
    direction: Direction | None = None
    """Direction to the sun, in place of that of the date."""
    frame: Literal["inertial", "orbital"] = "inertial"
    """Axes of the direction: inertial or orbital."""
    eclipse: StrictBool = True
    """Whether the Earth shades the craft on its orbit."""

    label = "sun"
    years = SERIES_YEARS
    channels = {"x": "1", "y": "1", "z": "1", "distance": "m", "visible": "1", "pressure": "Pa"}
    needs_orbit = False

    @model_validator(mode="after")
    def _direction_has_frame(self) -> Sun:
        if self.direction is None and self.frame == "orbital":
            refuse("found frame = 'orbital' without direction; give the direction")
        return self

    def constants(self, name: str, context: Context) -> Array:
        """Source of the direction, orbit, eclipse, radius of the shading body [m], epoch, and direction."""
        orbit = context.orbit
        if self.frame == "orbital" and orbit is None:
            raise ValueError(f"the direction of sun {name!r} is in orbital axes, and there is no orbit; give one")
        head = [float(orbit is not None), float(self.eclipse and orbit is not None), context.radius]
        if self.direction is None:
            around_earth(context, "the sun of a date")
            epoch = within_series(epoch_of(context, "the direction of the sun"))
            return np.array([DATE, *head, epoch, 0.0, 0.0, 0.0])
        source = ORBITAL if self.frame == "orbital" else INERTIAL
        return np.array([source, *head, 0.0, *unit_direction(name, "direction", self.direction)])


@inner
def sun_of_date(days: float) -> Vector:
    """Vector to the sun from the Earth [au], mean equator and equinox of date, at days since J2000."""
    degree = math.pi / 180.0
    g = (357.529 + 0.98560028 * days) * degree  # mean anomaly
    longitude = (280.459 + 0.98564736 * days + 1.915 * math.sin(g) + 0.020 * math.sin(2.0 * g)) * degree
    distance = 1.00014 - 0.01671 * math.cos(g) - 0.00014 * math.cos(2.0 * g)
    return ecliptic_to_equator((distance * math.cos(longitude), distance * math.sin(longitude), 0.0), days)


@inner
def visible_share(place: Vector, sun: Vector, radius: float, sun_radius: float) -> float:
    """Share of the sun's disc that a sphere of that radius at the origin leaves visible; place and sun from there."""
    to_sun = sub(sun, place)
    r, d = math.sqrt(dot(place, place)), math.sqrt(dot(to_sun, to_sun))
    if r <= radius:
        return 0.0
    a, b = math.asin(sun_radius / d), math.asin(radius / r)
    c = math.acos(max(-1.0, min(1.0, -dot(place, to_sun) / (r * d))))
    if c >= a + b:
        return 1.0
    if c <= abs(b - a):
        return 0.0 if b >= a else 1.0 - b * b / (a * a)
    x = (c * c + a * a - b * b) / (2.0 * c)
    y = math.sqrt(max(a * a - x * x, 0.0))
    overlap = a * a * math.acos(max(-1.0, min(1.0, x / a)))
    overlap += b * b * math.acos(max(-1.0, min(1.0, (c - x) / b))) - c * y
    return 1.0 - overlap / (math.pi * a * a)


@Sun.kernel
def sun(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: place and velocity on the orbit, where there is one."""
    p = parameters
    direction, distance, visible = load3(p, FIXED), AU, 1.0
    if p[SOURCE] == DATE:
        vector = scale(AU, sun_of_date(p[EPOCH] + t / DAY))
        distance = math.sqrt(dot(vector, vector))
        direction = scale(1.0 / distance, vector)
    elif p[SOURCE] == ORBITAL:
        up = load3(seen, 0)
        normal = cross(up, load3(seen, 3))
        up, normal = (scale(1.0 / math.sqrt(dot(up, up)), up), scale(1.0 / math.sqrt(dot(normal, normal)), normal))
        ahead = cross(normal, up)
        direction = add(scale(direction[0], normal), add(scale(direction[1], up), scale(direction[2], ahead)))
    if p[ECLIPSE] > 0.0:
        visible = visible_share(load3(seen, 0), scale(distance, direction), p[RADIUS], SUN_RADIUS)
    store3(out, 0, direction)
    out[3], out[4] = distance, visible
    out[5] = LIGHT_PRESSURE * visible * (AU / distance) ** 2
    out[6] = out[7] = out[8] = out[9] = 0.0
