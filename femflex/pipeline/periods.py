"""Limit of the number of calls of sampled controllers and sensors in a run, checked before it starts."""

from __future__ import annotations

from femflex.advice.limits import MOST_CALLS
from femflex.system import System


def check_periods(system: System, duration: float) -> None:
    """Raise ValueError for a controller that a run of that duration [s] would call too often."""
    for controller in system.controllers:
        calls = duration / controller.period
        if calls > MOST_CALLS:
            raise ValueError(
                f"controller {controller.name!r} has a period of {controller.period:g} s, so a run of {duration:g} s "
                f"would call it {calls:.3g} times; the most is {MOST_CALLS:g}. Lengthen the period, shorten the run, "
                "or run the controller continuously"
            )
