"""Limit of the number of calls of sampled controllers and sensors in a run, checked before it starts."""

from __future__ import annotations

from femflex.system import System

MOST_CALLS = 1e7  # of a controller or sensor in a run: at 0.2 ms each, half an hour


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
