"""Statements of effectors and controllers: angular momentum, events, and sensors that are no channels."""

from __future__ import annotations

from collections.abc import Mapping

from femflex.system import Channel, Effector, System, Threshold
from femflex.system.effector_problems import unknown_name_text

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
