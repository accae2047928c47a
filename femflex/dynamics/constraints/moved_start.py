"""What the start of a run moved: initial values that loops and constraints did not leave as they were given."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

NOTICED = 1e-9  # of the largest value with the same unit
NOTHING = 1e-12  # in SI: the rounding of a start in which all values of a unit are zero


@dataclass(frozen=True)
class MovedValue:
    """An initial value: its name and unit, as given and as the run starts from it (SI)."""

    name: str
    unit: str
    given: float
    started: float

    def __str__(self) -> str:
        """The change in words, with as many digits as it takes to see it, angles in degrees."""
        factor, unit = (math.degrees(1.0), "deg") if self.unit == "rad" else (1.0, self.unit)
        size = max(abs(self.given), abs(self.started))
        digits = max(4, 2 - math.floor(math.log10(abs(self.started - self.given) / size)))
        return f"{self.name} {factor * self.given:.{digits}g} -> {factor * self.started:.{digits}g} {unit}"


def moved_start(model: Model) -> list[MovedValue]:
    """The initial values that were moved to make the start consistent, those moved farthest first.

    How far is reported relative to the largest value of the same unit; what is below NOTICED of it has not moved.
    """
    system = model.system
    if model.constraints is None:
        return []
    names = [*system.coordinate_names(), *system.velocity_names()]
    given, started = system.initial_state(), model.x0
    size = np.maximum(np.abs(given), np.abs(started))
    scale = np.array([max(size[k] for k, other in enumerate(names) if other[1] == unit) for _, unit in names])
    far = np.abs(started - given)
    noticed = np.flatnonzero((far > NOTICED * scale) & (far > NOTHING))
    order = noticed[np.argsort(-far[noticed] / scale[noticed], kind="stable")]
    return [MovedValue(names[k][0], names[k][1], float(given[k]), float(started[k])) for k in order]
