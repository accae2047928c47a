"""Initial states of effectors from the value of a channel, such as the speed of a wheel, and what cannot start."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.system import Effector

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def with_starts(model: Model) -> Model:
    """Return the model with its effectors started by `Effector.starts`; states that System.z0 gives stay.

    The channels are linear in the states, so one evaluation for each finds them all.
    """
    system = model.system
    names = [name for name, _ in system.state_names()]
    targets = {
        f"{effector.name}.{state}": (f"effectors/{effector.name}/{channel}", value, size)
        for effector in system.effectors
        if isinstance(effector, Effector)
        for channel, (state, value) in effector.starts.items()
        for size in [float(effector.sizes[list(effector.states).index(state)])]
        if f"{effector.name}.{state}" not in system.z0
    }
    if not targets:
        return model
    first, n, x = model.n_q + model.n_u, len(targets), model.x0.copy()
    positions = [first + names.index(name) for name in targets]
    sizes = np.array([size for _, _, size in targets.values()])
    trials = np.tile(x, (1 + n, 1))
    trials[1 + np.arange(n), positions] += sizes
    channels = model.observe(np.zeros(1 + n), trials)
    values = np.stack([channels[path] for path, _, _ in targets.values()])  # channel, trial
    missing = np.array([value for _, value, _ in targets.values()]) - values[:, 0]
    x[positions] += np.linalg.solve(values[:, 1:] - values[:, :1], missing) * sizes
    return replace(model, x0=x)


def check_distances(model: Model) -> None:
    """Raise ValueError for an effector whose two markers coincide at the start, though its force needs a direction."""
    effectors = [e for e in model.system.effectors if isinstance(e, Effector) and e.apart > 0.0]
    if not effectors:
        return
    channels = model.observe(np.zeros(1), model.x0[None])
    for effector in effectors:
        a, b = effector.markers
        if channels[f"effectors/{effector.name}/distance"][0] < effector.apart:
            raise ValueError(
                f"{effector.kind} {effector.name!r}: markers {'.'.join(a)} and {'.'.join(b)} coincide at the start, so "
                "the push has no direction; place them apart along it, by less than the free length"
            )
