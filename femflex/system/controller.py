"""Sampled controllers: Python functions called at exact instants, whose commands are constant between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from femflex.arrays import Array

Law = Callable[[float, Mapping[str, Array], Array], tuple[Any, ...]]


@dataclass(frozen=True, eq=False)
class Controller:
    """A controller that is called every `period` seconds: command, memory = law(t, sensors, memory).

    law       any function. t is the instant [s], sensors the channels requested by path, as a run reports them at that
              instant, memory its own numbers (n_memory,) from the call before; it returns the commands (n_commands,),
              held until the next call, and the new memory; or these two and an instant [s] at which it is called once
              more before the next sample
    period    between two calls [s]
    sensors   paths of channels, as in "bodies/hub/rate" or "q"
    commands  name -> unit; the full name, by which effectors take it as an input, is "<controller>.<command>"
    memory    (n_memory,) its memory before the first call
    held      (n_commands,) commands before the first call
    start     time of the first call [s]
    follows   whether it only follows the motion, as shadow does: linear models hold its commands and memory, and its
              memory is neither reported by a channel for each number nor counted in the errors of steps

    Controllers that are due at one instant are called in the order of femflex.system.evaluation: one that has the
    command of another among its sensors ("effectors/<controller>/<command>") comes after it and sees the new one.

    Commands, memory and the time of the next call are states, so a run resumes as if it had not stopped. The law must
    keep nothing else in mind between two calls.
    """

    name: str
    law: Law
    period: float
    sensors: tuple[str, ...] = ()
    commands: Mapping[str, str] = field(default_factory=dict)
    memory: Array = field(default_factory=lambda: np.zeros(0))
    held: Array = field(default_factory=lambda: np.zeros(0))
    start: float = 0.0
    follows: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.period) and self.period > 0.0):
            raise ValueError(f"period of controller {self.name!r} is {self.period} s; it must be positive")
        if not self.commands:
            raise ValueError(f"controller {self.name!r} has no command; name one, as in commands={{'torque': 'N m'}}")
        if "next" in self.commands:
            raise ValueError(f"controller {self.name!r} has a command 'next', the name of its next sample; rename it")
        initial_commands = np.asarray(self.held, float)
        for key, value, n in (
            (
                "held",
                np.zeros(len(self.commands)) if initial_commands.size == 0 else initial_commands,
                len(self.commands),
            ),
            ("memory", np.atleast_1d(np.asarray(self.memory, float)), np.size(self.memory)),
        ):
            if value.shape != (n,) or not np.all(np.isfinite(value)):
                raise ValueError(f"{key} of controller {self.name!r} is {value.tolist()}; expected {n} finite numbers")
            object.__setattr__(self, key, value)

    def state_names(self) -> list[tuple[str, str]]:
        """Full name and unit of its states: commands, memory, and the time of the next sample."""
        memory = [(name, "1") for name in self.memory_names()]
        commands = [(f"{self.name}.{command}", unit) for command, unit in self.commands.items()]
        return [*commands, *memory, (f"{self.name}.next", "s")]

    def memory_names(self) -> list[str]:
        """Full names of the states that are its memory."""
        return [f"{self.name}.memory{k + 1}" for k in range(len(self.memory))]

    @property
    def sizes(self) -> Array:
        """Usual sizes of its states, in which the integrator's absolute tolerance counts."""
        sizes = np.ones(len(self.state_names()))
        if self.follows:
            sizes[len(self.commands) : -1] = np.inf
        return sizes

    def initial_states(self) -> Array:
        """Initial values of its states."""
        return np.concatenate([self.held, self.memory, [self.start]])

    def instant(self, k: int) -> float:
        """Time of sample number k [s]."""
        return self.start + k * self.period
