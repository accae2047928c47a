"""The Moon: its direction and distance from the centre of the Earth.

Montenbruck & Gill, Satellite Orbits (2000), section 3.3.2, about the mean equinox of date: the largest terms of lunar
theory in the mean anomalies l of the Moon and l' of the Sun, the Moon's mean distance F from its ascending node, and
its elongation D from the Sun. Direction to 0.1 deg and distance to 1000 km between 1950 and 2050.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from femflex.arrays import Array
from femflex.effectors.surroundings.earth import DAY, ecliptic_to_equator
from femflex.effectors.surroundings.noun import Surrounding, epoch_of
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Vector, dot, scale, store3
from femflex.system.acting import Context
from femflex.system.environment import within_series

DEGREE = math.pi / 180.0
SECOND = DEGREE / 3600.0  # of arc


class Moon(Surrounding, heading="surroundings"):
    """The Moon, from the date of the environment's epoch.

    Channels: x, y, z, the unit vector to the Moon from the Earth's centre in inertial axes; distance.
    """

    kind: Literal["moon"]
    """The Moon."""

    label = "moon"
    channels = {"x": "1", "y": "1", "z": "1", "distance": "m"}
    needs_orbit = False

    def constants(self, name: str, context: Context) -> Array:
        """Epoch, days since J2000. Raises ValueError for a date outside those of the series."""
        return np.array([within_series(epoch_of(context, "the direction of the moon"))])


@inner
def moon_of_date(days: float) -> Vector:
    """Vector to the Moon from the Earth [m], mean equator and equinox of date, at days since J2000."""
    T = days / 36525.0
    mean = (218.31617 + 481267.88088 * T) * DEGREE
    l = (134.96292 + 477198.86753 * T) * DEGREE
    s = (357.52543 + 35999.04944 * T) * DEGREE  # l'
    F = (93.27283 + 483202.01873 * T) * DEGREE
    D2 = 2.0 * (297.85027 + 445267.11135 * T) * DEGREE
    shift = 22640.0 * math.sin(l) + 769.0 * math.sin(2.0 * l) - 4586.0 * math.sin(l - D2) + 2370.0 * math.sin(D2)
    shift += -668.0 * math.sin(s) - 412.0 * math.sin(2.0 * F) - 212.0 * math.sin(2.0 * l - D2)
    shift += -206.0 * math.sin(l + s - D2) + 192.0 * math.sin(l + D2) - 165.0 * math.sin(s - D2)
    shift += 148.0 * math.sin(l - s) - 125.0 * math.sin(0.5 * D2) - 110.0 * math.sin(l + s)
    shift += -55.0 * math.sin(2.0 * F - D2)
    shift *= SECOND
    argument = F + shift + (412.0 * math.sin(2.0 * F) + 541.0 * math.sin(s)) * SECOND
    latitude = 18520.0 * math.sin(argument) - 526.0 * math.sin(F - D2) + 44.0 * math.sin(l + F - D2)
    latitude += -31.0 * math.sin(F - l - D2) - 25.0 * math.sin(F - 2.0 * l) - 23.0 * math.sin(s + F - D2)
    latitude += 21.0 * math.sin(F - l) + 11.0 * math.sin(F - s - D2)
    latitude *= SECOND
    kilometres = 385000.0 - 20905.0 * math.cos(l) - 3699.0 * math.cos(D2 - l) - 2956.0 * math.cos(D2)
    kilometres += -570.0 * math.cos(2.0 * l) + 246.0 * math.cos(2.0 * l - D2) - 205.0 * math.cos(s - D2)
    kilometres += -171.0 * math.cos(l + D2) - 152.0 * math.cos(l + s - D2)
    longitude, level = mean + shift, 1e3 * kilometres * math.cos(latitude)
    place = (level * math.cos(longitude), level * math.sin(longitude), 1e3 * kilometres * math.sin(latitude))
    return ecliptic_to_equator(place, days)


@Moon.kernel
def moon(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: place and velocity on the orbit, where there is one; they are not used."""
    vector = moon_of_date(parameters[0] + t / DAY)
    distance = math.sqrt(dot(vector, vector))
    store3(out, 0, scale(1.0 / distance, vector))
    out[3] = distance
    out[4] = out[5] = out[6] = out[7] = 0.0
