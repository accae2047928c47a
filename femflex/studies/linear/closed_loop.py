"""Control loops that grow, known before a run: the fastest pole of the closed loop against that of the open one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.dynamics.equilibria.equilibrium import EquilibriumError
from femflex.studies.linear.linear_model import linear_model
from femflex.studies.linear.poles import poles_of
from femflex.studies.linear.sampled import sampled_model
from femflex.system import Effector, System, signal

GROWN = 0.1  # of its amplitude, by which a motion must grow within the run
ROUNDING = 1e-6  # growth over the largest pole that rounding explains
SPLIT = 1e-4  # of multipliers: a double one of rigid motion splits by the root of rounding
MANY = 300  # states up to which poles are sought: a second's work
LAWS = ("state_space", "attitude_feedback")  # effectors that are controllers


def growing_loops(system: System, duration: float) -> list[Advice]:
    """A warning where the controllers make a small motion about rest grow within the duration [s].

    It compares the largest real part of the poles, or the largest multiplier of sampled controllers of one period, with
    and without the controllers; signals over time are zero, and timed thrusters off. Crafts without an equilibrium,
    with delayed or differently sampled controllers, or of more than 300 states are not assessed.
    """
    laws = [one.name for one in system.effectors if not isinstance(one, Effector) or one.act in LAWS]
    if not laws or len(system.all_state_names()) > MANY:
        return []
    system = replace(
        system, effectors=tuple(_still(one) if isinstance(one, Effector) else one for one in system.effectors)
    )
    try:
        growth, frequency, without = _sampled(system) if system.controllers else _continuous(system)
    except (ValueError, KeyError, ArithmeticError, EquilibriumError, np.linalg.LinAlgError):
        return []
    if growth * duration < GROWN or growth <= without * (1.0 + ROUNDING):
        return []
    motion = f"oscillates with {frequency:.4g} Hz and grows" if frequency else "grows"
    text = (
        f"controllers {', '.join(laws)}: the closed loop is unstable. A small motion about rest {motion} at "
        f"{growth:.4g} 1/s, e^{growth * duration:.3g} times in the run of {duration:.4g} s; with the controllers off "
        f"the fastest growth is {without:.4g} 1/s. Check the signs and sizes of the gains, the axes of sensors and "
        "actuators, and the sampling"
    )
    return [doubt("", "craft", text, growth, without)]


def _continuous(system: System) -> tuple[float, float, float]:
    """Fastest growth [1/s] with its frequency [Hz], and that without the controllers."""
    off = replace(system, effectors=tuple(_off(one) if isinstance(one, Effector) else one for one in system.effectors))
    found = []
    for one in (system, off):
        poles = [pole for pole in poles_of(linear_model(one, inputs=[])) if not pole.rigid]
        largest = max((abs(pole.value) for pole in poles), default=0.0)
        fastest = max(poles, key=lambda pole: pole.value.real, default=None)
        grows = fastest is not None and fastest.value.real > ROUNDING * largest
        found.append((fastest.value.real, fastest.frequency) if fastest is not None and grows else (0.0, 0.0))
    return *found[0], found[1][0]


def _still(one: Effector) -> Effector:
    """A signal over time at zero, a timed thruster without thrust; any other effector as it is."""
    if one.act == "signal":
        return replace(one, parameters=signal(one.name, [0.0], [0.0]).parameters, breaks=np.zeros(0))
    if one.act == "thruster" and len(one.breaks):
        return replace(one, parameters=np.concatenate([one.parameters[:3], [0.0], one.parameters[4:]]))
    return one


def _off(one: Effector) -> Effector:
    """A controller whose outputs are zero; any other effector as it is."""
    if one.act == "state_space":
        m, n, p = (int(x) for x in one.parameters[:3])
        numbers = one.parameters.copy()
        start = 4 + n * n + n * m
        numbers[start : start + p * n + p * m] = 0.0
        return replace(one, parameters=numbers)
    if one.act == "attitude_feedback":
        return replace(one, parameters=np.concatenate([[one.parameters[0]], np.zeros(27), one.parameters[28:]]))
    return one


def _sampled(system: System) -> tuple[float, float, float]:
    """The same of sampled controllers, from the multipliers of a period; open: their commands held."""
    model = sampled_model(system)
    closed, held = model.multipliers()[0], np.abs(np.linalg.eigvals(model.flow)).max()
    growth, without = (float(np.log(abs(z))) / model.period if abs(z) > 1.0 + SPLIT else 0.0 for z in (closed, held))
    return growth, float(abs(np.angle(closed)) / (2.0 * np.pi * model.period)), without
