"""Forces and torques by their spectra: power spectral densities, and lines at fixed frequencies."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.disturbances.disturbance import Line, MarkerDisturbance, check_frequencies, log_interpolated
from femflex.noun.table import refuse
from femflex.noun.values import Quantity, counted_noun

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
