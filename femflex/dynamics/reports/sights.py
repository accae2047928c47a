"""What lines of sight report: direction and distance of the station, its elevation, and what the axis misses it by."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.rotations import dcm_from_quaternion
from femflex.system import Channel, System

XYZ = ("x", "y", "z")


def sight_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of what lines of sight report."""
    out = {}
    for sight in system.sights:
        path, where = f"sights/{sight.name}", f"{sight.body}.{sight.marker}"
        out[f"{path}/error"] = Channel("rad", f"angle from the axis of {where} to the station")
        out[f"{path}/range"] = Channel("m", f"distance of the station from {where}")
        out[f"{path}/elevation"] = Channel("rad", f"elevation of {where} over the station's horizon")
        out[f"{path}/position"] = Channel("m", f"place of {where} from O", (3,), XYZ, "inertial")
        out[f"{path}/direction"] = Channel("1", f"unit vector from {where} to the station", (3,), XYZ, "inertial")
    return out


def observe_sights(system: System, times: Array, seen: Mapping[str, Array]) -> dict[str, Array]:
    """The channels of `sight_channels` at times (n_t,), from what the system reports of bodies and orbit."""
    out = {}
    for sight in system.sights:
        place, C_NM = marker_motion(system, times, seen, sight.body, sight.marker)
        pointed = C_NM @ sight.axis
        up = dcm_from_quaternion(seen["orbit/attitude"])[:, :, 1]
        station = sight.station(times)
        away = station - seen["orbit/radius"][:, None] * up - place
        distance = np.linalg.norm(away, axis=1)
        ahead = away / distance[:, None]
        off = np.linalg.norm(np.cross(pointed, ahead), axis=1)
        path = f"sights/{sight.name}"
        out[f"{path}/error"] = np.arctan2(off, np.einsum("ti,ti->t", pointed, ahead))
        out[f"{path}/range"], out[f"{path}/position"], out[f"{path}/direction"] = distance, place, ahead
        out[f"{path}/elevation"] = np.arcsin(-np.einsum("ti,ti->t", ahead, station / sight.radius))
    return out
