"""The pointing budget: small motions of a craft under disturbances, by frequency, source and mode."""

from __future__ import annotations

from femflex.studies.jitter.budget import (
    Budget,
    Contribution,
    SpeedScan,
    amplitude_covariance,
    frequency_panels,
    jitter,
    stress_peaks,
)
from femflex.studies.jitter.full import FullResponse, full_response
from femflex.studies.jitter.plant import Plant, jitter_plant
from femflex.studies.jitter.shock import BaseMode, base_modes, combined_peaks, miles, shock_spectrum

__all__ = [
    "BaseMode",
    "Budget",
    "Contribution",
    "FullResponse",
    "Plant",
    "SpeedScan",
    "amplitude_covariance",
    "base_modes",
    "combined_peaks",
    "frequency_panels",
    "full_response",
    "jitter",
    "jitter_plant",
    "miles",
    "shock_spectrum",
    "stress_peaks",
]
