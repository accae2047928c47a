"""Trains of pulses, and stepper drives: a pulse, or two opposite ones, at a steady rate.

Rectangular pulses of height F and width w at the rate f have the lines 2 F w f |sin(pi k f w) / (pi k f w)| at k f. A
step of a drive is a pulse and, a width later, its opposite: each line times 2 |sin(pi k f w)|.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.disturbances.disturbance import Line, MarkerDisturbance, range_of
from femflex.noun.table import refuse
from femflex.noun.values import Direction, Quantity

TURN = 2.0 * math.pi
MOST_LINES = 5000  # of one train below the highest frequency
Frequency = Annotated[float, Quantity("Hz", above=0.0)]
FrequencyRange = Annotated[tuple[float, float], Quantity("Hz", (2,), above=0.0)]
Width = Annotated[float, Quantity("s", above=0.0)]


class _Train(MarkerDisturbance):
    """A train of pulses at a rate or over a range of rates."""

    rate: Frequency | None = None
    """Number of pulses or steps per second."""
    rates_between: FrequencyRange | None = None
    """Lowest and highest rate, instead of one rate."""
    width: Width
    """Width of a pulse."""

    @model_validator(mode="after")
    def _rate_fits(self) -> _Train:
        range_of(self.rate, self.rates_between, ("rate", "rates_between"))
        return self

    @property
    def rates(self) -> tuple[float, float] | None:
        """Range of rates [rad/s]."""
        return None if self.rates_between is None else (TURN * self.rates_between[0], TURN * self.rates_between[1])

    def train(self, rate: float, highest: float, height: np.ndarray, double: bool) -> list[Line]:
        """Lines of pulses of a height (6,) at a rate [rad/s], by default its own, up to a frequency [Hz]; double:
        with their opposites."""
        f = rate / TURN
        if self.width * f * (1 + double) > 1.0:
            refuse(f"found pulses of {self.width:g} s at {f:g} per second, which overlap; give a shorter width")
        k = np.arange(1, min(int(highest / f), MOST_LINES) + 1)
        size = 2.0 * self.width * f * np.abs(np.sinc(k * f * self.width))
        if double:
            size = size * 2.0 * np.abs(np.sin(np.pi * k * f * self.width))
        return [Line(float(n), float(n * f), s * height.astype(complex)) for n, s in zip(k, size, strict=True) if s > 0]


class Pulses(_Train):
    """Rectangular pulses at a steady rate, such as those of a thruster; their mean is no disturbance."""

    kind: Literal["pulses"] = "pulses"
    """Selects this disturbance: a train of pulses."""
    force: Annotated[tuple[float, float, float], Quantity("N", (3,))] = (0.0, 0.0, 0.0)
    """Force during a pulse."""
    torque: Annotated[tuple[float, float, float], Quantity("N m", (3,))] = (0.0, 0.0, 0.0)
    """Torque during a pulse."""

    @model_validator(mode="after")
    def _acts(self) -> Pulses:
        if not any((*self.force, *self.torque)):
            refuse("found neither force nor torque; give at least one")
        return self

    def lines(self, rate: float | None, highest: float) -> list[Line]:
        """The lines at a rate [rad/s], by default its own, up to a frequency [Hz]."""
        return self.train(rate or TURN * (self.rate or 0.0), highest, np.array([*self.force, *self.torque]), False)


class Stepper(_Train):
    """A stepper drive, such as that of a solar array: the reaction of each step, and cogging at the rate of steps."""

    kind: Literal["stepper"] = "stepper"
    """Selects this disturbance: a stepper drive."""
    axis: Direction = (0.0, 0.0, 1.0)
    """Axis of the drive, in the marker's axes."""
    torque: Annotated[float, Quantity("N m", least=0.0)]
    """Torque during each of the two pulses of a step."""
    cogging: Annotated[float, Quantity("N m", least=0.0)] = 0.0
    """Amplitude of the cogging torque."""
    cogging_order: Annotated[float, Quantity("", above=0.0)] = 1.0
    """Frequency of cogging over the rate of steps."""

    def lines(self, rate: float | None, highest: float) -> list[Line]:
        """The lines at a rate [rad/s], by default its own, up to a frequency [Hz]: steps, then cogging."""
        rate = rate or TURN * (self.rate or 0.0)
        axis = np.concatenate([np.zeros(3), np.array(self.axis) / np.linalg.norm(self.axis)])
        out = self.train(rate, highest, self.torque * axis, True) if self.torque else []
        frequency = self.cogging_order * rate / TURN
        if self.cogging and frequency <= highest:
            out.append(Line(self.cogging_order, frequency, (self.cogging * axis).astype(complex)))
        return out
