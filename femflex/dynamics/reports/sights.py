"""Channels of lines of sight: direction and distance of the station, its elevation, the axis' pointing error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.rotations import dcm_from_quaternion
from femflex.system import Channel, System

XYZ = ("x", "y", "z")


def sight_channels(system: System) -> dict[str, Channel]:
    """Return path, unit and meaning of the channels of lines of sight."""
    out = {}
    for sight in system.sights:
        path, where = f"sights/{sight.name}", f"{sight.body}.{sight.marker}"
        out[f"{path}/error"] = Channel("rad", f"angle from the axis of {where} to the station")
        out[f"{path}/range"] = Channel("m", f"distance of the station from {where}")
        out[f"{path}/elevation"] = Channel("rad", f"elevation of {where} over the station's horizon")
        out[f"{path}/position"] = Channel("m", f"place of {where} from O", (3,), XYZ, "inertial")
        out[f"{path}/direction"] = Channel("1", f"unit vector from {where} to the station", (3,), XYZ, "inertial")
    return out


def observe_sights(system: System, times: Array, channels: Mapping[str, Array]) -> dict[str, Array]:
    """Return the channels of `sight_channels` at times (n_t,), from those of bodies and orbit."""
    out = {}
    for sight in system.sights:
        position, C_NM = marker_motion(system, times, channels, sight.body, sight.marker)
        pointed = C_NM @ sight.axis
        up = dcm_from_quaternion(channels["orbit/attitude"])[:, :, 1]
        station = sight.station(times)
        to_station = station - channels["orbit/radius"][:, None] * up - position
        distance = np.linalg.norm(to_station, axis=1)
        direction = to_station / distance[:, None]
        sine = np.linalg.norm(np.cross(pointed, direction), axis=1)
        path = f"sights/{sight.name}"
        out[f"{path}/error"] = np.arctan2(sine, np.einsum("ti,ti->t", pointed, direction))
        out[f"{path}/range"], out[f"{path}/position"], out[f"{path}/direction"] = distance, position, direction
        out[f"{path}/elevation"] = np.arcsin(-np.einsum("ti,ti->t", direction, station / sight.radius))
    return out
