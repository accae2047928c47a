"""Environment of a craft, except its orbit: uniform gravity on the ground, and attraction by the central body."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array
from femflex.system.orbit import EARTH_RADIUS

ATTRACTIONS = ("auto", "gradient", "exact")
EARTH_J2 = 1.08262668e-3  # EGM96
STANDARD_GRAVITY = 9.80665  # m/s^2, the 3rd General Conference on Weights and Measures, 1901


@dataclass(frozen=True, eq=False)
class Environment:
    """Fields that act on every body of a system.

    gravity (3,) acceleration of free fall, inertial components [m/s^2]; zero: none. An orbit has its own gravity.
    attraction   of the central body in orbit: "gradient", linear over the craft (eq. 6); "exact", -mu R/|R|^3 at points
                 of mass; "auto", exact for craft beyond a size over the orbit's radius (`femflex.system.attraction`)
    oblateness   J2 of the central body, whose pole is the inertial Z axis; 0: none
    radius       its equatorial radius, which J2 is defined with [m]
    epoch        date of t = 0, days since J2000 (2000-01-01, 12:00 UTC), on which sun, field and sidereal time depend
    """

    gravity: Array = field(default_factory=lambda: np.zeros(3))
    attraction: str = "auto"
    oblateness: float = 0.0
    radius: float = EARTH_RADIUS
    epoch: float | None = None

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
        if not (np.isfinite([self.oblateness, self.radius]).all() and self.radius > 0):
            raise ValueError(
                f"oblateness is {self.oblateness} and radius {self.radius} m; give finite numbers, the radius positive"
            )

    @property
    def has_weight(self) -> bool:
        """Whether bodies weigh anything in it."""
        return bool(self.gravity.any())
