"""Random forces and torques by their power spectral density."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.disturbances.disturbance import MarkerDisturbance, check_frequencies, log_interpolated
from femflex.noun.table import refuse
from femflex.noun.values import Quantity

FORCE_PSD, TORQUE_PSD = "N^2/Hz", "N^2 m^2/Hz"


class RandomForce(MarkerDisturbance):
    """A random force and torque with one-sided spectral densities, straight on log axes between the frequencies."""

    kind: Literal["random"] = "random"
    """Selects this disturbance: a random force and torque."""
    frequencies: Annotated[tuple[float, ...], Quantity("Hz", (None,), above=0.0)]
    """Frequencies of the table, rising; the spectrum is zero outside of them."""
    force: Annotated[tuple[tuple[float, float, float], ...], Quantity(FORCE_PSD, (None, 3), least=0.0)] | None = None
    """One-sided spectral density of the three components of the force, which are independent."""
    torque: Annotated[tuple[tuple[float, float, float], ...], Quantity(TORQUE_PSD, (None, 3), least=0.0)] | None = None
    """One-sided spectral density of the three components of the torque."""

    @model_validator(mode="after")
    def _rows_fit(self) -> RandomForce:
        if self.force is None and self.torque is None:
            refuse("found neither force nor torque; give one row of three for each frequency")
        rows = {key: len(getattr(self, key)) for key in ("force", "torque") if getattr(self, key) is not None}
        check_frequencies(self.frequencies, rows)
        return self

    def spectrum(self, frequencies: Array) -> Array:
        """One-sided spectral density (n, 6) at frequencies (n,) [Hz]."""
        none = ((0.0, 0.0, 0.0),) * len(self.frequencies)
        values = np.hstack([np.array(self.force or none), np.array(self.torque or none)])
        return log_interpolated(frequencies, np.array(self.frequencies), values)

    @property
    def band(self) -> tuple[float, float]:
        """Its first and last frequency [Hz]."""
        return self.frequencies[0], self.frequencies[-1]

    def breaks(self) -> Array:
        """Its frequencies (n,) [Hz]."""
        return np.array(self.frequencies)
