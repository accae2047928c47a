"""Admissible functions and preload of a body, as a case describes them."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, StrictBool, model_validator

from femflex.noun.table import Table, refuse
from femflex.noun.values import (
    MOST_FUNCTIONS,
    Count,
    Direction,
    Mass,
    Position,
    Quantity,
    Rate,
    Rates,
    Vector,
)
from femflex.reduction.preload.loads import Preload


class FunctionsTable(Table):
    """Admissible functions of a beam: how many for each field, and which."""

    y: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for bending along the section's y axis."""
    z: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for bending along the section's z axis."""
    axial: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for axial displacement."""
    torsion: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for the twist angle."""
    family: Literal["characteristic", "polynomial"] = "characteristic"
    """Functions: "characteristic", the vibration modes of a uniform beam; "polynomial", polynomials of the same
    supports."""
    ends: str = "clamped-free"
    """Supports of root and tip in the body frame, such as "clamped-free"; each is free, pinned or clamped."""
    static: StrictBool = False
    """The last functions are the static shapes of an accelerated root."""
    spin: StrictBool | None = None
    """Static shapes of a spin in addition to the functions: two more along y and along z, one of axial
    displacement and one of torsion, where strain is not linear. Only for clamped-free characteristic functions. Left
    out: true where the case spins steadily, unless `static` is given."""
    joints: list[Literal["root", "tip"]] | None = None
    """Static shapes of an accelerated root and of a tip force and moment in addition to the functions: two more along y
    and z for each, one of axial displacement and one of torsion. Only for clamped-free characteristic functions. Left
    out: those that change by 0.05 % one of the craft's first three elastic frequencies, one below `band`, or one that
    the run excites, unless `static` is given."""
    loads: StrictBool | None = None
    """Static shapes of a force and a moment at the tip in addition to the functions, as those of `joints`: for loads at
    the tip. Only for clamped-free characteristic functions. Left out: where the functions answer such a load by less
    than 99 % of its static work, as one function answers a force (97 %), and many a moment or a torque."""


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

    def preload(self, rate: float | None) -> Preload:
        """The Preload; rate: of an orbit that states none. Raises ValueError where it needs one and there is none."""
        field = np.zeros((3, 3))
        if self.spin is not None:
            field = np.asarray(Preload.spin(self.spin).gradient)
        if self.orbit is not None:
            rate = rate if self.orbit.rate is None else self.orbit.rate
            if rate is None:
                raise ValueError("found no rate, and the case has no [orbit]; give one")
            field = np.asarray(Preload.orbit(rate, self.orbit.vertical, self.orbit.normal).gradient)
        return Preload(self.acceleration, field, self.origin, self.forces, self.masses)
