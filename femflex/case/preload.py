"""[bodies.<name>.preload]: steady loads under which a body finds its static equilibrium before it is reduced."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from femflex.noun.table import Table, refuse
from femflex.noun.values import Direction, Mass, Position, Quantity, Rate, Rates, Vector


class OrbitField(Table):
    """Gravity gradient and centrifugal field at rest in the frame of a circular orbit."""

    vertical: Direction
    """Outward local vertical in the body frame."""
    normal: Direction
    """Orbit normal in the body frame, at right angles to the vertical."""
    rate: Rate | None = None
    """Orbital rate. Default: the mean motion of the case's orbit."""


class PreloadTable(Table):
    """Steady loads of the body's own static equilibrium, in the body frame."""

    acceleration: Annotated[Vector, Quantity("m/s^2", (3,))] = (0.0, 0.0, 0.0)
    """Gravity: the acceleration with which bodies fall."""
    spin: Rates | None = None
    """Steady angular rate, whose centrifugal field loads the body. Default: none."""
    orbit: OrbitField | None = None
    """Gravity gradient and centrifugal field of a circular orbit. Default: none."""
    origin: Position = (0.0, 0.0, 0.0)
    """Point on the axis of the spin, or moving along the orbit."""
    forces: dict[str, Annotated[Vector, Quantity("N", (3,))]] = Field(default_factory=dict)
    """Group -> force at the mean position of its nodes; it keeps its direction."""
    masses: dict[str, Mass] = Field(default_factory=dict)
    """Group -> mass of bodies attached there by joints, on which gravity, spin and orbit act too."""

    @model_validator(mode="after")
    def _has_one_field_and_a_load(self) -> PreloadTable:
        if self.spin is not None and self.orbit is not None:
            refuse("found spin and orbit together; the field of the orbit holds its rate already, so give one of them")
        if not (any(self.acceleration) or self.spin or self.orbit or self.forces):
            refuse("found no load; give acceleration, spin, orbit or forces")
        return self
