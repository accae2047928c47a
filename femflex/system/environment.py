"""Environment of a craft, except its orbit: uniform gravity on the ground, attraction by central and third bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array
from femflex.system.orbit import EARTH_RADIUS

ATTRACTIONS = ("auto", "gradient", "exact")
EARTH_ZONALS = (1.08262668e-3, -2.53265649e-6, -1.61962159e-6, -2.27296083e-7, 5.40681239e-7)  # J2 to J6, EGM96
EARTH_J2 = EARTH_ZONALS[0]
THIRD_BODIES = {"sun": 1.32712440018e20, "moon": 4.902800066e12}  # gravitational parameter, m^3/s^2, DE 430
SERIES_YEARS = (1950.0, 2050.0)  # in which the places of Sun and Moon are as accurate as stated
STANDARD_GRAVITY = 9.80665  # m/s^2, the 3rd General Conference on Weights and Measures, 1901


@dataclass(frozen=True, eq=False)
class Environment:
    """Fields that act on every body of a system.

    gravity (3,) acceleration of free fall, inertial components [m/s^2]; zero: none. An orbit has its own gravity.
    attraction   of the central body in orbit: "gradient", linear over the craft (eq. 6); "exact", -mu R/|R|^3 at points
                 of mass; "auto", exact for craft beyond a size over the orbit's radius (`femflex.system.attraction`)
    oblateness   J2 of the central body, whose pole is the inertial Z axis, or J2 to J6 at most; 0: none
    radius       its equatorial radius, which these are defined with [m]
    epoch        date of t = 0, days since J2000 (2000-01-01, 12:00 UTC), on which sun, field and sidereal time depend
    third_bodies of "sun" and "moon" those whose tides act, on a free orbit of the Earth
    """

    gravity: Array = field(default_factory=lambda: np.zeros(3))
    attraction: str = "auto"
    oblateness: float | Sequence[float] = 0.0
    radius: float = EARTH_RADIUS
    epoch: float | None = None
    third_bodies: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        value = np.asarray(self.gravity, float)
        if value.shape != (3,) or not np.all(np.isfinite(value)):
            raise ValueError(
                f"gravity is {self.gravity}; expected three finite numbers [m/s^2], inertial components, such as "
                f"[0, 0, -{STANDARD_GRAVITY}]"
            )
        object.__setattr__(self, "gravity", value)
        if self.attraction not in ATTRACTIONS:
            raise ValueError(f"attraction {self.attraction!r} is not known; known are {list(ATTRACTIONS)}")
        zonals = np.atleast_1d(np.asarray(self.oblateness, float))
        if not (np.isfinite([*zonals.ravel(), self.radius]).all() and self.radius > 0):
            raise ValueError(
                f"oblateness is {self.oblateness} and radius {self.radius} m; give finite numbers, the radius positive"
            )
        if zonals.ndim != 1 or not 1 <= zonals.size <= len(EARTH_ZONALS):
            raise ValueError(
                f"oblateness has {zonals.size} numbers; give J2, or a list from J2 to a degree of at most "
                f"{1 + len(EARTH_ZONALS)}"
            )
        for name in self.third_bodies:
            if name not in THIRD_BODIES:
                raise ValueError(f"third body {name!r} is not known; known are {list(THIRD_BODIES)}")
        if self.third_bodies and self.epoch is None:
            raise ValueError(
                f"the place of the {' and the '.join(self.third_bodies)} depends on the date; give environment.epoch, "
                "a date and time in UTC"
            )
        if self.third_bodies and self.epoch is not None:
            within_series(self.epoch)

    @property
    def zonals(self) -> Array:
        """J2, J3, ... of the central body up to the last that is not zero (n,)."""
        return np.trim_zeros(np.atleast_1d(np.asarray(self.oblateness, float)), "b")

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
