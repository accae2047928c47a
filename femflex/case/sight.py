"""[[sights]]: axes of markers that are to look at a station on the turning Earth."""

from __future__ import annotations

from pydantic import field_validator

from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Angle, Direction, PositiveLength, Rate


class SightTable(Table):
    """A line of sight; the run reports by how much the axis misses the station, its range and elevation."""

    name: Name
    """Name in channels and messages."""
    body: str
    """Body that carries the instrument."""
    marker: str = "origin"
    """Marker of the line of sight."""
    axis: Direction = (1.0, 0.0, 0.0)
    """Direction of the line of sight, in the marker's axes."""
    latitude: Angle = 0.0
    """Geocentric latitude of the station."""
    longitude: Angle = 0.0
    """Longitude of the station at t = 0, from the inertial X axis (the node's reference)."""
    radius: PositiveLength = 6378137.0
    """Distance of the station from the Earth's centre."""
    rate: Rate = 7.292115e-5
    """Angular rate of the Earth."""

    @field_validator("axis")
    @classmethod
    def _has_direction(cls, axis: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(axis):
            refuse("found [0, 0, 0], which has no direction; give three numbers, not all zero")
        return axis
