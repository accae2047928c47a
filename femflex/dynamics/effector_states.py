"""Statements of effectors and controllers: angular momentum, events, and sensors that are no channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.system import Channel, Effector, System, Threshold
from femflex.system.effector_problems import unknown_name_text

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


SETTLING, STEP, SETTLED = 60, 1e-4, 1e-10  # iterations; step and last change, in sizes of the states
MOMENTUM = ("momentum_x", "momentum_y", "momentum_z")  # channels, inertial components


def momentum_channels(system: System) -> list[list[str]]:
    """Paths of the three components of angular momentum of every effector that reports them."""
    effectors = [e for e in system.effectors if isinstance(e, Effector) and set(MOMENTUM) <= e.channels.keys()]
    return [[f"effectors/{effector.name}/{channel}" for channel in MOMENTUM] for effector in effectors]


def keeps_momentum(effector: Effector) -> bool:
    """Return whether an effector leaves the momentum of the whole craft as it is, its own included."""
    return effector.conserves or set(MOMENTUM) <= effector.channels.keys()


def sensor_problems(system: System, channels: Mapping[str, Channel]) -> list[str]:
    """Sentences on sensors of controllers that are no channels."""
    return [
        unknown_name_text(f"sensor {path!r} of controller {controller.name!r} is no channel", path, list(channels))
        for controller in system.controllers
        for path in controller.sensors
        if path not in channels
    ]


def threshold_problems(system: System, channels: Mapping[str, Channel]) -> list[str]:
    """Sentences on thresholds at which latches open that are no channels of one number."""
    out = []
    for joint in system.joints:
        for path in {latch.opens.channel for latch in joint.latches if isinstance(latch.opens, Threshold)}:
            if path not in channels:
                out.append(
                    unknown_name_text(
                        f"{path!r}, at which joint {joint.label!r} opens, is no channel", path, list(channels)
                    )
                )
            elif channels[path].shape:
                out.append(
                    f"channel {path!r}, at which joint {joint.label!r} opens, has {channels[path].shape[0]} entries; "
                    "give one of a single number, such as an output of a sensor"
                )
    return out


def has_events(system: System) -> bool:
    """Whether an effector of the system has events."""
    return any(isinstance(effector, Effector) and effector.events for effector in system.effectors)


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


def with_settled_starts(model: Model) -> Model:
    """Return the model in which the states of effectors that start settled (`Effector.settles`) do not change.

    Raises ValueError with the state that goes on changing.
    """
    system = model.system
    names = [name for name, _ in system.state_names()]
    effectors = [e for e in system.effectors if isinstance(e, Effector) and e.settles]
    own = [name for e in effectors for name, _ in e.state_names() if name not in system.z0]
    if not own:
        return model
    places = model.n_q + model.n_u + np.array([names.index(name) for name in own])
    sizes = system.state_sizes()[places - model.n_q - model.n_u]
    x = model.x0.copy()

    def rates(dz: Array) -> Array:
        y = x.copy()
        y[places] += dz
        return np.asarray(model.state_rate(0.0, y)[places])

    for _ in range(SETTLING):
        rate = rates(0.0 * sizes)
        F = np.stack([(rates(step) - rates(-step)) / (2 * step.max()) for step in np.diag(STEP * sizes)], axis=1)
        change = np.where(F.any(axis=1), np.linalg.lstsq(F, -rate, rcond=None)[0], sizes)  # nothing holds some states
        if not F.any(axis=1).all():
            break
        x[places] += np.clip(change, -sizes / 2, sizes / 2)
        if np.abs(change).max() < SETTLED * np.abs(x[places]).max():
            return replace(model, x0=x)
    worst = int(np.argmax(np.abs(change) / sizes))
    raise ValueError(
        f"the state {own[worst]!r} has no value at which it stays at the start, as where no light reaches a surface, "
        "or where it does not radiate; give its initial value instead of equilibrium"
    )


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


def with_linear_effectors(system: System) -> System:
    """The system with effectors as linear models have them (`Effector.linear`); itself where that changes none."""
    if not any(isinstance(effector, Effector) and effector.linear is not None for effector in system.effectors):
        return system
    effectors = [e.linear(e) if isinstance(e, Effector) and e.linear is not None else e for e in system.effectors]
    return replace(system, effectors=tuple(effectors))
