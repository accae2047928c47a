"""Disturbances of pointing: what wheels, drives, coolers, thrusters and shaken bases do, as lines and spectra."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from femflex.disturbances.base import BaseMotion, BaseVibration, Shock
from femflex.disturbances.disturbance import Line, MarkerDisturbance, Source
from femflex.disturbances.jitter import JitterOutput, JitterTable
from femflex.disturbances.pulses import Pulses, Stepper
from femflex.disturbances.spectra import RandomForce, SpectralLines
from femflex.disturbances.wheel import WheelDisturbance

Disturbance = Annotated[
    WheelDisturbance | Stepper | Pulses | SpectralLines | RandomForce | BaseVibration | Shock,
    Field(discriminator="kind"),
]

__all__ = [
    "BaseMotion",
    "BaseVibration",
    "Disturbance",
    "JitterOutput",
    "JitterTable",
    "Line",
    "MarkerDisturbance",
    "Pulses",
    "RandomForce",
    "Shock",
    "Source",
    "SpectralLines",
    "Stepper",
    "WheelDisturbance",
]
