"""What surrounds a craft beside its orbit: uniform gravity on the ground."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665  # m/s^2, the 3rd General Conference on Weights and Measures, 1901


@dataclass(frozen=True, eq=False)
class Environment:
    """Fields that act on every body of a system.

    gravity (3,) acceleration of free fall, inertial components [m/s^2]; zero: none. An orbit has its own gravity.
    """

    gravity: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        value = np.asarray(self.gravity, float)
        if value.shape != (3,) or not np.all(np.isfinite(value)):
            raise ValueError(
                f"gravity is {self.gravity}; expected three finite numbers [m/s^2], inertial components, such as "
                f"[0, 0, -{STANDARD_GRAVITY}]"
            )
        object.__setattr__(self, "gravity", value)

    @property
    def has_weight(self) -> bool:
        """Whether bodies weigh anything in it."""
        return bool(self.gravity.any())
