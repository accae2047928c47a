"""Unstable control loops, detected before a run: the fastest pole of the closed loop against that of the open loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.effectors.constant_commands import with_held_commands
from femflex.linear.equilibrium import EquilibriumError
from femflex.studies.linear.linear_model import linear_model
from femflex.studies.linear.poles import poles_of
from femflex.studies.linear.sampled import sampled_model
from femflex.system import Effector, System

GROWN = 0.1  # of its amplitude, by which a motion must grow within the run
ROUNDING = 1e-6  # growth over the largest pole that rounding explains
SPLIT = 1e-4  # of multipliers: a double one of rigid motion splits by the root of rounding
MANY = 300  # states up to which poles are computed, within about a second


def growing_loops(system: System, duration: float) -> list[Advice]:
    """A warning where the controllers make a small motion about rest grow within the duration [s].

    It compares the largest real part of the poles, or the largest multiplier of sampled controllers of one period, with
    and without the controllers; signals over time are zero, and timed thrusters off. Crafts without an equilibrium,
    with delayed or differently sampled controllers, or of more than 300 states are not assessed.
    """
    laws = [
        effector.name
        for effector in system.effectors
        if (effector.kind == "controller" if isinstance(effector, Effector) else not effector.follows)
    ]
    system = with_held_commands(system, loops=False)
    if not laws or len(system.all_state_names()) > MANY:
        return []
    system = _silenced(system, controllers=False)
    try:
        growth, frequency, open_growth = _sampled_growth(system) if system.controllers else _continuous_growth(system)
    except (ValueError, KeyError, ArithmeticError, EquilibriumError, np.linalg.LinAlgError):
        return []
    if growth * duration < GROWN or growth <= open_growth * (1.0 + ROUNDING):
        return []
    motion = f"oscillates with {frequency:.4g} Hz and grows" if frequency else "grows"
    text = (
        f"controllers {', '.join(laws)}: the closed loop is unstable. A small motion about rest {motion} at "
        f"{growth:.4g} 1/s, e^{growth * duration:.3g} times in the run of {duration:.4g} s; with the controllers off "
        f"the fastest growth is {open_growth:.4g} 1/s. Check the signs and sizes of the gains, the axes of sensors and "
        "actuators, and the sampling"
    )
    return [doubt("", "craft", text, growth, open_growth)]


def _continuous_growth(system: System) -> tuple[float, float, float]:
    """Fastest growth [1/s] with its frequency [Hz], and that without the controllers."""
    results = []
    for variant in (system, _silenced(system, controllers=True)):
        poles = [pole for pole in poles_of(linear_model(variant, inputs=[])) if not pole.rigid]
        largest = max((abs(pole.value) for pole in poles), default=0.0)
        fastest = max(poles, key=lambda pole: pole.value.real, default=None)
        grows = fastest is not None and fastest.value.real > ROUNDING * largest
        results.append((fastest.value.real, fastest.frequency) if fastest is not None and grows else (0.0, 0.0))
    return *results[0], results[1][0]


def _silenced(system: System, controllers: bool) -> System:
    """The system with outputs of controllers at zero, or else signals over time at zero and timed thrusters off."""
    effectors = tuple(
        item.silent()
        if isinstance(item, Effector) and item.silent is not None and (item.kind == "controller") == controllers
        else item
        for item in system.effectors
    )
    return replace(system, effectors=effectors)


def _sampled_growth(system: System) -> tuple[float, float, float]:
    """As `_continuous_growth`, from the multipliers of a sampling period; open loop means constant commands."""
    model = sampled_model(system)
    closed, open_multiplier = model.multipliers()[0], np.abs(np.linalg.eigvals(model.flow)).max()
    growth, open_growth = (
        float(np.log(abs(z))) / model.period if abs(z) > 1.0 + SPLIT else 0.0 for z in (closed, open_multiplier)
    )
    return growth, float(abs(np.angle(closed)) / (2.0 * np.pi * model.period)), open_growth
