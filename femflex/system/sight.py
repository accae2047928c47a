"""Lines of sight to a station on the turning Earth, and the pointing error of an axis along them."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.noun.table import Name, Table
from femflex.noun.values import Angle, Axis, PositiveLength, Rate
from femflex.system.orbit import EARTH_RADIUS

EARTH_RATE = 7.292115e-5  # rad/s, inertial (WGS 84)


class Sight(Table):
    """A line of sight to a station on a sphere that turns about the inertial Z; the run reports by how much the axis
    misses the station, its range and elevation."""

    name: Name
    """Name in channels and messages."""
    body: str
    """Body that carries the instrument."""
    marker: str = "origin"
    """Marker of the line of sight."""
    axis: Axis = (1.0, 0.0, 0.0)
    """Direction of the line of sight, in the marker's axes."""
    latitude: Angle = 0.0
    """Geocentric latitude of the station."""
    longitude: Angle = 0.0
    """Longitude of the station at t = 0, from the inertial X axis (the node's reference)."""
    radius: PositiveLength = EARTH_RADIUS
    """Distance of the station from the Earth's centre."""
    rate: Rate = EARTH_RATE
    """Angular rate of the Earth."""

    def station(self, times: Array) -> Array:
        """Place of the station at times (n_t,), inertial components from the Earth's centre, (n_t, 3) [m]."""
        angle = self.longitude + self.rate * np.asarray(times, float)
        level = np.cos(self.latitude) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return self.radius * np.column_stack([level, np.full(len(angle), np.sin(self.latitude))])
