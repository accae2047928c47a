"""Wheels and gyros about a steady state: rotors of constant momentum, which make small motions gyroscopic."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from femflex.dynamics.model import compile_system
from femflex.system import Effector, System


def with_coasting_rotors(system: System, keep: Collection[str] = ()) -> System:
    """The system whose wheels and gyros keep their momentum and gimbal angles of the start, without states.

    A motor that gives a torque accelerates its wheel for ever, so nothing else is a steady state. Left as they are:
    those whose signals something else takes, for there is a loop around them, and those to keep.
    """
    in_loops = {name.rpartition(".")[0] for e in system.effectors if isinstance(e, Effector) for name in e.inputs}
    in_loops |= set(keep)
    rotors = [e for e in system.effectors if isinstance(e, Effector) and e.coasting and e.name not in in_loops]
    if not rotors:
        return system
    names = [name for name, _ in system.state_names()]
    model = compile_system(system)
    z = dict(zip(names, model.parts(model.x0)[2], strict=True))
    changed: list[Effector] = []
    for rotor in rotors:
        states = np.array([z[name] for name, _ in rotor.state_names()])
        assert rotor.coasting is not None
        changed.append(rotor.coasting(rotor.name, states))
    new = {rotor.name: rotor for rotor in changed}
    removed = {name for rotor in rotors for name, _ in rotor.state_names()}
    effectors = tuple(new.get(e.name, e) for e in system.effectors)
    return replace(system, effectors=effectors, z0={k: v for k, v in system.z0.items() if k not in removed})


def controlled_rotors(system: System) -> list[str]:
    """Return the names of wheels and gyros that a continuous law commands by measurements of sensors."""
    by_name = {e.name: e for e in system.effectors if isinstance(e, Effector)}

    def measures(name: str, visited: frozenset[str]) -> bool:
        effector = by_name.get(name)
        if effector is None or name in visited:
            return False
        sources = {source.rpartition(".")[0] for source in effector.inputs}
        return effector.kind == "sensor" or any(measures(source, visited | {name}) for source in sources)

    return [name for name, effector in by_name.items() if effector.coasting and measures(name, frozenset())]
