"""System with constant commands of sampled controllers, as linearisation and rest need it."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeGuard

import numpy as np

from femflex.effectors.block_kernels import state_space
from femflex.effectors.signal import constant_signal
from femflex.noun.parametric import UNLIMITED
from femflex.system.controller import Controller
from femflex.system.effector import Effector
from femflex.system.system import System

FOLLOWER = "follower"  # kind of a block that holds what follows the motion, as shadow does
UNIT = "-unit"  # after the name of a controller: a signal that its held commands multiply


def with_held_commands(system: System, *, loops: bool = True, followers: bool = True) -> System:
    """Return the system in which sampled controllers keep their commands before the first sample.

    loops: those that control; followers: those that follow the motion.
    """
    held = [effector for effector in system.controllers if (followers if effector.follows else loops)]
    effectors = tuple(
        part
        for effector in system.effectors
        for part in (_constant_commands(effector) if is_sampled(effector) and effector in held else (effector,))
    )
    names = {name for effector in held for name, _ in effector.state_names()}
    return replace(system, effectors=effectors, z0={k: v for k, v in system.z0.items() if k not in names})


def with_followers_of(system: System, settled: System) -> System:
    """Return the system with what follows the motion held as in another, which is at rest."""
    blocks = {part.name: part for part in settled.effectors}
    names = {effector.name for effector in system.controllers if effector.follows}
    held = with_held_commands(system, loops=False)
    effectors = tuple(blocks[part.name] if part.name in names else part for part in held.effectors)
    return replace(held, effectors=effectors)


def is_sampled(effector: Effector | Controller) -> TypeGuard[Controller]:
    """Whether something that acts is a sampled controller."""
    return isinstance(effector, Controller)


def stands_for_controller(effector: Effector) -> bool:
    """Return whether an effector stands for the constant commands of a controller."""
    return effector.kind != FOLLOWER and effector.inputs == (f"{effector.name}{UNIT}.value",)


def _constant_commands(controller: Controller) -> tuple[Effector, Effector]:
    """A signal that is 1, and a block that multiplies it by the commands, and by the memory that others may take."""
    constants, channels = controller.held, dict(controller.commands)
    if controller.follows:
        constants = np.concatenate([constants, controller.memory])
        channels |= {name.removeprefix(f"{controller.name}."): "1" for name in controller.memory_names()}
    n = len(constants)
    numbers = np.concatenate([[1.0, 0.0, n, 0.0], constants, np.full(n, UNLIMITED)])
    unit = f"{controller.name}{UNIT}"
    block = Effector(
        controller.name,
        state_space,
        inputs=(f"{unit}.value",),
        channels=channels,
        parameters=numbers,
        kind=FOLLOWER if controller.follows else "controller",
    )
    return constant_signal(unit, 1.0), block
