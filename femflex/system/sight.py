"""Lines of sight to a station on the turning Earth, and the pointing error of an axis along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.system.orbit import EARTH_RADIUS

EARTH_RATE = 7.292115e-5  # rad/s, inertial (WGS 84)


@dataclass(frozen=True, eq=False)
class Sight:
    """A marker's axis that is to look at a station on a sphere turning about the inertial Z.

    axis (3,)   in the marker's components; any length but zero
    latitude    [rad];  longitude  [rad] from the inertial X at t = 0, where the station's meridian is then
    radius      of the station from the Earth's centre [m];  rate  of the Earth [rad/s]
    """

    name: str
    body: str
    marker: str = "origin"
    axis: Array = (1.0, 0.0, 0.0)  # type: ignore[assignment]
    latitude: float = 0.0
    longitude: float = 0.0
    radius: float = EARTH_RADIUS
    rate: float = EARTH_RATE

    def __post_init__(self) -> None:
        axis = np.asarray(self.axis, float)
        if axis.shape != (3,) or not np.linalg.norm(axis) > 0:
            raise ValueError(f"axis of sight {self.name!r} is {axis.tolist()}; give three numbers, not all zero")
        object.__setattr__(self, "axis", axis / np.linalg.norm(axis))
        if not self.radius > 0:
            raise ValueError(f"radius of sight {self.name!r} is {self.radius:g} m; it must be above 0")

    def station(self, times: Array) -> Array:
        """Place of the station at times (n_t,), inertial components from the Earth's centre, (n_t, 3) [m]."""
        angle = self.longitude + self.rate * np.asarray(times, float)
        level = np.cos(self.latitude) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return self.radius * np.column_stack([level, np.full(len(angle), np.sin(self.latitude))])
