"""Environment of a craft, except its orbit: uniform gravity on the ground, attraction by central and third bodies."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, date, datetime
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_serializer, model_validator

from femflex.arrays import Array
from femflex.noun.table import Table, refuse
from femflex.noun.units import UnitError
from femflex.noun.values import PositiveLength, Quantity, ValueProblem, _Readable, value_text
from femflex.system.orbit import EARTH_RADIUS

J2000 = datetime(2000, 1, 1, 12, tzinfo=UTC)


class EpochValue(_Readable):
    """A date and time in UTC, of TOML or as a text of ISO 8601. Reads into days since J2000 (2000-01-01, 12:00)."""

    def read_value(self, value: Any) -> float:
        """Days since J2000. A time without a zone is UTC."""
        if isinstance(value, str):
            try:
                value = datetime.fromisoformat(value)
            except ValueError:
                raise ValueProblem(
                    f"found {value!r}; expected a date and time in UTC, such as 2026-03-20T14:46:00Z"
                ) from None
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if isinstance(value, date) and not isinstance(value, datetime):
            value = datetime(value.year, value.month, value.day)
        if not isinstance(value, datetime):
            raise ValueProblem(
                f"found {value_text(value)}; expected a date and time in UTC, such as 2026-03-20T14:46:00Z"
            )
        value = value if value.tzinfo else value.replace(tzinfo=UTC)
        return (value - J2000).total_seconds() / 86400.0

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of a date and time."""
        return {"format": "date-time", "description": "date and time in UTC"}


def days_since_j2000(value: datetime | date | str) -> float:
    """Days since J2000 of a date and time in UTC. Raises ValueError for a text that is none."""
    return EpochValue().read_value(value)


EARTH_ZONALS = (1.08262668e-3, -2.53265649e-6, -1.61962159e-6, -2.27296083e-7, 5.40681239e-7)  # J2 to J6, EGM96
EARTH_J2 = EARTH_ZONALS[0]
THIRD_BODIES = {"sun": 1.32712440018e20, "moon": 4.902800066e12}  # gravitational parameter, m^3/s^2, DE 430
SERIES_YEARS = (1950.0, 2050.0)  # in which the places of Sun and Moon are as accurate as stated
STANDARD_GRAVITY = 9.80665  # m/s^2, the 3rd General Conference on Weights and Measures, 1901


@dataclass(frozen=True)
class GravityValue(_Readable):
    """Acceleration of free fall: a number, downwards along -z, or a vector. Reads into inertial components."""

    strength = Quantity("m/s^2")
    direction = Quantity("m/s^2", (3,))

    def read_value(self, value: Any) -> Array:
        """(3,) [m/s^2]."""
        if isinstance(value, list | tuple):
            return np.array(self.direction.read_value(value))
        g = self.strength.read_value(value)
        if g < 0.0:
            raise ValueProblem(
                f"found {g:g} m/s^2; a single number is the strength of gravity along -z and is not negative, another "
                'direction takes three numbers, such as [0, 0, "9.81 m/s^2"]'
            )
        return np.array([0.0, 0.0, -g])

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
        if not isinstance(value, list | tuple):
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


class Environment(Table):
    """Environment of the craft, except its orbit."""

    gravity: Annotated[Array, GravityValue()] = Field(default_factory=lambda: np.zeros(3))
    """Uniform gravity on the ground: a number acts along -z, three components are along inertial axes. Default: none;
    an orbit has its own gravity."""
    attraction: Literal["auto", "gradient", "exact"] = "auto"
    """Attraction of the central body in orbit. gradient: linear over the craft. exact: -mu R/|R|^3 at points of mass.
    auto: exact for craft larger than 1e-4 of the distance from the centre (680 m in low orbit)."""
    oblateness: Annotated[tuple[float, ...], ZonalsValue()] = (0.0,)
    """J2 of the central body, 1.08262668e-3 for the Earth, or a list of J2 to J6 at most; "earth" has these of EGM96.
    Its pole is the inertial Z axis."""
    radius: PositiveLength = EARTH_RADIUS
    """Equatorial radius of the central body, with which its oblateness is defined. Default: that of [orbit]."""
    epoch: Annotated[float, EpochValue()] | None = None
    """Date and time at t = 0, UTC, on which the surroundings depend: sun, magnetic field, rotation of the Earth. The
    inertial axes are then those of the mean equator and equinox of this date."""
    third_bodies: tuple[Literal["sun", "moon"], ...] = ()
    """Bodies whose tides act on a free orbit of the Earth: sun, moon. They need an epoch."""

    __eq__, __hash__ = object.__eq__, object.__hash__  # by identity: its gravity is an array

    @model_validator(mode="after")
    def _dated(self) -> Environment:
        if self.third_bodies and self.epoch is None:
            refuse(
                f"the place of the {' and the '.join(self.third_bodies)} depends on the date; give environment.epoch, "
                "a date and time in UTC"
            )
        if self.third_bodies and self.epoch is not None:
            try:
                within_series(self.epoch)
            except ValueError as error:
                refuse(str(error))
        return self

    @field_serializer("gravity")
    def _listed(self, value: Array) -> list[float]:
        return list(value.tolist())

    @property
    def zonals(self) -> Array:
        """J2, J3, ... of the central body up to the last that is not zero (n,)."""
        return np.trim_zeros(np.array(self.oblateness), "b")

    @property
    def has_weight(self) -> bool:
        """Whether bodies weigh anything in it."""
        return bool(self.gravity.any())


def within_series(epoch: float) -> float:
    """A date, days since J2000. Raises ValueError where the places of Sun and Moon are not known."""
    year = 2000.0 + epoch / 365.25
    if not SERIES_YEARS[0] <= year <= SERIES_YEARS[1]:
        raise ValueError(
            f"found the year {year:.1f}; the places of Sun and Moon are known from {SERIES_YEARS[0]:g} to "
            f"{SERIES_YEARS[1]:g}"
        )
    return epoch
