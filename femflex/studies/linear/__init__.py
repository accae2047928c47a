"""Linear models of a craft: state space about an equilibrium, a steady spin or an instant of a motion."""

from __future__ import annotations

from femflex.studies.linear.files import save_model
from femflex.studies.linear.linear_model import LinearModel, linear_model
from femflex.studies.linear.poles import Pole, poles_of
from femflex.studies.linear.sampled import Margins, SampledModel, margins, sampled_model
from femflex.studies.linear.space import StateSpace
from femflex.studies.linear.truncated import Truncated, balanced_truncation, modal_truncation, transmission_zeros

__all__ = [
    "LinearModel",
    "Margins",
    "Pole",
    "SampledModel",
    "StateSpace",
    "Truncated",
    "balanced_truncation",
    "linear_model",
    "margins",
    "modal_truncation",
    "poles_of",
    "sampled_model",
    "save_model",
    "transmission_zeros",
]
