"""Integration in time: explicit and implicit methods that know only the compiled model's call.

A model offers the calls of `protocol`; `integrator(name, rtol=...)` makes a method from the register, whose `solve`
gives a whole trajectory and `blocks` one piece at a time, with a state to resume from, bit for bit. `choose` picks a
method and says why. Kernels are loaded when a method is first used, not when this package is imported.
"""

from femflex.integrate.choice import Choice, Forecast, choose, forecast
from femflex.integrate.dop853 import Dop853
from femflex.integrate.esdirk import Esdirk4
from femflex.integrate.outcome import Block, IntegrationError, Interrupted, Solution, Steps
from femflex.integrate.protocol import (
    CORRECT,
    KINEMATIC,
    RATE,
    Integrator,
    Model,
    SecondOrder,
)
from femflex.integrate.register import INTEGRATORS, integrator

__all__ = [
    "CORRECT",
    "INTEGRATORS",
    "KINEMATIC",
    "RATE",
    "Block",
    "Choice",
    "Dop853",
    "Esdirk4",
    "Forecast",
    "IntegrationError",
    "Integrator",
    "Interrupted",
    "Model",
    "SecondOrder",
    "Solution",
    "Steps",
    "choose",
    "forecast",
    "integrator",
]
