"""Calls of sampled controllers: the instant of the next one, and its effect on the state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.system import Controller
from femflex.system.evaluation import CHANNEL_FOLDER, evaluation_order

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


ROUNDED = 1e-6  # part of a period by which an instant may be early


@dataclass(frozen=True, eq=False)
class Sampler:
    """A controller and the places of its commands, memory and next sample in x."""

    controller: Controller
    commands: slice
    memory: slice
    next_instant: int


@dataclass(frozen=True, eq=False)
class Clock:
    """The controllers of a model (see `Clock` in femflex.integrate.protocol)."""

    model: Model

    @cached_property
    def samplers(self) -> list[Sampler]:
        """The controllers, in their order of evaluation."""
        names = [name for name, _ in self.model.system.all_state_names()]
        samplers = []
        for controller in evaluation_order(self.model.system.controllers):
            first = names.index(controller.state_names()[0][0])
            memory = first + len(controller.commands)
            last = memory + len(controller.memory)
            samplers.append(Sampler(controller, slice(first, memory), slice(memory, last), last))
        return samplers

    def next_instant(self, x: Array) -> float:
        """Time of the next call [s]."""
        return float(min(x[sampler.next_instant] for sampler in self.samplers))

    def sample(self, t: float, x: Array) -> None:
        """Call every controller that is due at t; its commands, memory and next instant are written into x, in place.

        Those that are due together see the motion of that instant, and each the commands of those before it.
        """
        due = [sampler for sampler in self.samplers if x[sampler.next_instant] <= t]
        paths = sorted({path for sampler in due for path in sampler.controller.sensors})
        measured = self.model.channel_values(t, x, paths) if paths else {}
        for sampler in due:
            controller = sampler.controller
            readings = {path: np.array(measured[path]) for path in controller.sensors}
            command, memory, sooner = call_controller(controller, t, readings, x[sampler.memory].copy())
            x[sampler.commands], x[sampler.memory] = command, memory
            k = math.floor((t - controller.start) / controller.period + ROUNDED) + 1
            x[sampler.next_instant] = min(controller.instant(k), math.inf if sooner is None else sooner)
            for name, value in zip(controller.commands, command, strict=True):
                if f"{CHANNEL_FOLDER}{controller.name}/{name}" in measured:
                    measured[f"{CHANNEL_FOLDER}{controller.name}/{name}"] = value


def call_controller(
    controller: Controller, t: float, sensors: Mapping[str, Array], memory: Array
) -> tuple[Array, Array, float | None]:
    """Commands, memory and an instant before the next sample (None: none) that a controller answers, checked."""
    try:
        answer = controller.law(t, sensors, memory)
    except Exception as error:
        raise ValueError(
            f"controller {controller.name!r} raised {type(error).__name__} at t = {t:.9g} s: {error}"
        ) from error
    if not (isinstance(answer, tuple) and len(answer) in (2, 3)):
        raise ValueError(
            f"controller {controller.name!r} answered {answer!r} at t = {t:.9g} s; expected (command, memory)"
        )
    checked = []
    for what, value, n in (("command", answer[0], len(controller.commands)), ("memory", answer[1], len(memory))):
        try:
            array = np.atleast_1d(np.asarray([] if value is None else value, float))
        except (TypeError, ValueError):
            raise ValueError(
                f"the {what} of controller {controller.name!r} at t = {t:.9g} s is {value!r}; expected {n} numbers"
            ) from None
        if array.shape != (n,):
            raise ValueError(
                f"the {what} of controller {controller.name!r} at t = {t:.9g} s has shape {array.shape}; "
                f"expected ({n},)"
            )
        if not np.all(np.isfinite(array)):
            raise ValueError(
                f"the {what} of controller {controller.name!r} at t = {t:.9g} s is not finite: {array.tolist()}"
            )
        checked.append(array)
    sooner = None if len(answer) == 2 or answer[2] is None else float(answer[2])
    if sooner is not None and not t < sooner:
        raise ValueError(
            f"controller {controller.name!r}, called at t = {t:.9g} s, requested its next call at {sooner:.9g} s; give "
            "a later time"
        )
    return checked[0], checked[1], sooner
