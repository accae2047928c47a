"""Reported states of effectors and controllers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.system import Channel, Controller, Effector, System, Threshold
from femflex.system.effector_problems import unknown_name_text

MOMENTUM = ("momentum_x", "momentum_y", "momentum_z")  # channels, inertial components


def state_channels(system: System) -> dict[str, Channel]:
    """Channels of the states of effectors and controllers."""
    out = {}
    for effector in system.effectors:
        sampling = ""
        if isinstance(effector, Controller):
            sampling = f", sampled every {effector.period:g} s (zero-order hold)"
        for name, unit in effector.state_names():
            state = name.removeprefix(effector.name + ".")
            out[f"effectors/{effector.name}/{state}"] = Channel(unit, f"state {state} of {effector.name}{sampling}")
    return out


def observe_states(system: System, z: Array) -> dict[str, Any]:
    """The channels of `state_channels` at states z (n_t, n_z)."""
    columns = {name: k for k, (name, _) in enumerate(system.state_names())}
    return {
        f"effectors/{effector.name}/{name.removeprefix(effector.name + '.')}": z[:, columns[name]]
        for effector in system.effectors
        for name, _ in effector.state_names()
    }


def add_angular_momentum(system: System, out: dict[str, Any]) -> None:
    """Add the angular momentum of effectors (channels momentum_x, momentum_y, momentum_z) to the craft's."""
    for effector in system.effectors:
        if isinstance(effector, Effector) and set(MOMENTUM) <= effector.channels.keys():
            components = [out[f"effectors/{effector.name}/{channel}"] for channel in MOMENTUM]
            out["monitors/angular_momentum"] = out["monitors/angular_momentum"] + np.stack(components, axis=-1)


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
