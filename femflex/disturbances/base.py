"""Vibration and shock of a base that carries the whole craft: an acceleration along one direction."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.disturbances.disturbance import Source, check_frequencies, log_interpolated
from femflex.noun.table import refuse
from femflex.noun.values import Direction, Quantity

ACCELERATION_PSD = "m^2/s^4/Hz"


class BaseMotion(Source):
    """A motion of the base on which the craft is mounted, along one direction of the inertial axes."""

    components: ClassVar[int] = 1

    direction: Direction
    """Direction of the acceleration, in inertial axes."""

    @property
    def unit_direction(self) -> Array:
        """The direction (3,) as a unit vector, inertial axes."""
        return np.array(self.direction) / np.linalg.norm(self.direction)


class BaseVibration(BaseMotion):
    """Random acceleration of the base on which the craft is mounted, along one direction of the inertial axes."""

    kind: Literal["base"] = "base"
    """Selects this disturbance: random vibration of the base."""
    frequencies: Annotated[tuple[float, ...], Quantity("Hz", (None,), above=0.0)]
    """Frequencies of the table, rising; the spectrum is zero outside of them."""
    psd: Annotated[tuple[float, ...], Quantity(ACCELERATION_PSD, (None,), least=0.0)]
    """One-sided spectral density of the acceleration, straight on log axes; also texts such as "0.04 g0^2/Hz"."""
    interface: str | None = None
    """Channel of the force between base and craft, such as "joints/clamp/force:y", for a notch by a limit of force."""
    force: Annotated[tuple[float, ...], Quantity("N^2/Hz", (None,), above=0.0)] | None = None
    """Largest spectral density of that force at the frequencies; the acceleration is lowered where it would be more."""

    @model_validator(mode="after")
    def _rows_fit(self) -> BaseVibration:
        check_frequencies(
            self.frequencies, {"psd": len(self.psd), **({"force": len(self.force)} if self.force else {})}
        )
        if (self.interface is None) != (self.force is None):
            refuse("found one of interface and force alone; they go together")
        return self

    def force_limit(self, frequencies: Array) -> Array:
        """Largest spectral density (n,) [N^2/Hz] of the force of the interface at frequencies (n,) [Hz]."""
        return log_interpolated(frequencies, np.array(self.frequencies), np.array(self.force))

    def spectrum(self, frequencies: Array) -> Array:
        """One-sided spectral density (n, 1) [(m/s^2)^2/Hz] at frequencies (n,) [Hz]."""
        return log_interpolated(frequencies, np.array(self.frequencies), np.array(self.psd)[:, None])

    @property
    def band(self) -> tuple[float, float]:
        """Its first and last frequency [Hz]."""
        return self.frequencies[0], self.frequencies[-1]

    def breaks(self) -> Array:
        """Its frequencies (n,) [Hz]."""
        return np.array(self.frequencies)


class Shock(BaseMotion):
    """A shock of the base by its response spectrum: the peak of the absolute acceleration of oscillators on it."""

    kind: Literal["shock"] = "shock"
    """Selects this disturbance: a shock of the base by its response spectrum."""
    frequencies: Annotated[tuple[float, ...], Quantity("Hz", (None,), above=0.0)]
    """Frequencies of the table, rising."""
    peaks: Annotated[tuple[float, ...], Quantity("m/s^2", (None,), least=0.0)]
    """Peak acceleration of an oscillator of each frequency, with the damping of the modes; also texts such as
    "500 g0"."""

    @model_validator(mode="after")
    def _rows_fit(self) -> Shock:
        check_frequencies(self.frequencies, {"peaks": len(self.peaks)})
        return self

    def peaks_at(self, frequencies: Array) -> Array:
        """Peak acceleration (n,) [m/s^2] of oscillators of frequencies (n,) [Hz]; zero outside of the table."""
        return log_interpolated(frequencies, np.array(self.frequencies), np.array(self.peaks))
