"""Initial states of effectors that are given by what a channel is to be at the start, such as the speed of a wheel."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.system import Effector

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def with_starts(model: Model) -> Model:
    """The model whose effectors start as `Effector.starts` says; states that System.z0 gives stay.

    A channel is linear in its state, so two evaluations of it find the state.
    """
    system = model.system
    names = [name for name, _ in system.state_names()]
    wanted = {
        f"{effector.name}.{state}": (f"effectors/{effector.name}/{channel}", value, size)
        for effector in system.effectors
        if isinstance(effector, Effector)
        for channel, (state, value) in effector.starts.items()
        for size in [float(effector.sizes[list(effector.states).index(state)])]
        if f"{effector.name}.{state}" not in system.z0
    }
    if not wanted:
        return model
    first, x = model.n_q + model.n_u, model.x0.copy()
    ahead = x.copy()
    for name, (_, _, size) in wanted.items():
        ahead[first + names.index(name)] += size
    seen = model.observe(np.zeros(2), np.stack([x, ahead]))
    for name, (path, value, size) in wanted.items():
        here, there = seen[path]
        x[first + names.index(name)] += (value - here) / (there - here) * size
    return replace(model, x0=x)
