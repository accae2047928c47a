"""[environment]: uniform gravity on the ground, and the attraction of the central body in orbit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from femflex.noun.epoch import EpochValue
from femflex.noun.table import Table
from femflex.noun.units import UnitError
from femflex.noun.values import Quantity, ValueProblem, Vector, _Readable
from femflex.system import EARTH_ZONALS


@dataclass(frozen=True)
class GravityValue(_Readable):
    """Acceleration of free fall: a number, downwards along -z, or a vector. Reads into inertial components."""

    strength = Quantity("m/s^2")
    direction = Quantity("m/s^2", (3,))

    def read_value(self, value: Any) -> Vector:
        """(3,) [m/s^2]."""
        if isinstance(value, list):
            return self.direction.read_value(value)
        g = self.strength.read_value(value)
        if g < 0.0:
            raise ValueProblem(
                f"found {g:g} m/s^2; a single number is the strength of gravity along -z and is not negative, another "
                'direction takes three numbers, such as [0, 0, "9.81 m/s^2"]'
            )
        return (0.0, 0.0, -g)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the two forms."""
        return {"anyOf": [self.strength.json_schema(), self.direction.json_schema()], "unit": "m/s^2"}


@dataclass(frozen=True)
class ZonalsValue(_Readable):
    """Zonal harmonics of the central body: J2, a list from J2 on, or "earth". Reads into (J2, J3, ...)."""

    one = Quantity()
    several = Quantity(shape=(None,))

    def read_value(self, value: Any) -> tuple[float, ...]:
        """J2 and those after it."""
        if value == "earth":
            return EARTH_ZONALS
        if not isinstance(value, list):
            try:
                return (self.one.read_value(value),)
            except (ValueProblem, UnitError) as problem:
                raise ValueProblem(f"{problem}, a list from J2 on, or 'earth'") from None
        zonals: tuple[float, ...] = self.several.read_value(value)
        if len(zonals) > len(EARTH_ZONALS):
            highest = 1 + len(EARTH_ZONALS)
            raise ValueProblem(
                f"found {len(zonals)} numbers, up to J{1 + len(zonals)}; expected J2 to J{highest} at most"
            )
        return zonals

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the three forms."""
        several = self.several.json_schema() | {"maxItems": len(EARTH_ZONALS)}
        return {"anyOf": [self.one.json_schema(), several, {"const": "earth"}], "unit": "1"}


class EnvironmentTable(Table):
    """Environment of the craft, except its orbit."""

    gravity: Annotated[Vector, GravityValue()] = (0.0, 0.0, 0.0)
    """Uniform gravity on the ground: a number acts along -z, three components are along inertial axes. Zero in orbit.
    """
    attraction: Literal["auto", "gradient", "exact"] = "auto"
    """Attraction of the central body in orbit. gradient: linear over the craft. exact: -mu R/|R|^3 at points of mass.
    auto: exact for craft larger than 1e-4 of the distance from the centre (680 m in low orbit)."""
    oblateness: Annotated[tuple[float, ...], ZonalsValue()] = (0.0,)
    """J2 of the central body, 1.08262668e-3 for the Earth, or a list of J2 to J6 at most; "earth" has these of EGM96.
    Its pole is the inertial Z axis, its radius that of [orbit]."""
    third_bodies: list[Literal["sun", "moon"]] = Field(default_factory=list)
    """Bodies whose tides act on a free orbit of the Earth: sun, moon. They need an epoch."""
    epoch: Annotated[float, EpochValue()] | None = None
    """Date and time at t = 0, UTC, on which the surroundings depend: sun, magnetic field, rotation of the Earth. The
    inertial axes are then those of the mean equator and equinox of this date."""
