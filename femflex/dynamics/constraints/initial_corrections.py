"""Initial values that loops and constraints corrected at the start of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

RELATIVE_TOLERANCE = 1e-9  # of the largest value with the same unit
ABSOLUTE_TOLERANCE = 1e-12  # in SI: the rounding of a start in which all values of a unit are zero


@dataclass(frozen=True)
class CorrectedInitialValue:
    """An initial value: its name and unit, as given and as the run starts from it (SI)."""

    name: str
    unit: str
    given: float
    started: float

    def __str__(self) -> str:
        """Return the correction in words, with as many digits as show it, angles in degrees."""
        factor, unit = (math.degrees(1.0), "deg") if self.unit == "rad" else (1.0, self.unit)
        size = max(abs(self.given), abs(self.started))
        digits = max(4, 2 - math.floor(math.log10(abs(self.started - self.given) / size)))
        return f"{self.name} {factor * self.given:.{digits}g} -> {factor * self.started:.{digits}g} {unit}"


def initial_corrections(model: Model) -> list[CorrectedInitialValue]:
    """Return the initial values that were corrected to make the start consistent, largest corrections first.

    How far is reported relative to the largest value of the same unit; what is below NOTICED of it has not moved.
    """
    system = model.system
    if model.constraints is None:
        return []
    names = [*system.coordinate_names(), *system.velocity_names()]
    requested, started = system.initial_state(), model.x0
    size = np.maximum(np.abs(requested), np.abs(started))
    scale = np.array([max(size[k] for k, pair in enumerate(names) if pair[1] == unit) for _, unit in names])
    change = np.abs(started - requested)
    noticed = np.flatnonzero((change > RELATIVE_TOLERANCE * scale) & (change > ABSOLUTE_TOLERANCE))
    order = noticed[np.argsort(-change[noticed] / scale[noticed], kind="stable")]
    return [CorrectedInitialValue(names[k][0], names[k][1], float(requested[k]), float(started[k])) for k in order]
