"""Lines at fixed frequencies, such as those of a cooler or a pump."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.disturbances.disturbance import Line, MarkerDisturbance
from femflex.noun.table import refuse
from femflex.noun.values import Quantity, counted_noun


class SpectralLines(MarkerDisturbance):
    """Forces and torques at fixed frequencies with independent phases, such as those of a cooler."""

    kind: Literal["lines"] = "lines"
    """Selects this disturbance: lines at fixed frequencies."""
    frequencies: Annotated[tuple[float, ...], Quantity("Hz", (None,), above=0.0)]
    """Frequencies of the lines."""
    force: Annotated[tuple[tuple[float, float, float], ...], Quantity("N", (None, 3))] | None = None
    """Amplitude of the force of each line, three components that are in phase."""
    torque: Annotated[tuple[tuple[float, float, float], ...], Quantity("N m", (None, 3))] | None = None
    """Amplitude of the torque of each line, three components in phase with the force."""

    @model_validator(mode="after")
    def _rows_fit(self) -> SpectralLines:
        if self.force is None and self.torque is None:
            refuse("found neither force nor torque; give one row of three for each frequency")
        for key in ("force", "torque"):
            rows = getattr(self, key)
            if rows is not None and len(rows) != len(self.frequencies):
                refuse(
                    f"found {counted_noun(len(rows), 'row', 'rows')} in {key} and {len(self.frequencies)} frequencies"
                )
        return self

    @property
    def band(self) -> tuple[float, float]:
        """A little below its lowest and above its highest frequency [Hz]."""
        return 0.999 * min(self.frequencies), 1.001 * max(self.frequencies)

    def lines(self, rate: float | None, highest: float) -> list[Line]:
        """The lines up to a frequency [Hz]."""
        none = ((0.0, 0.0, 0.0),) * len(self.frequencies)
        rows = zip(self.frequencies, self.force or none, self.torque or none, strict=True)
        return [Line(1.0, f, np.array([*force, *torque], complex)) for f, force, torque in rows if f <= highest]
