"""What lines of sight report: direction and distance of the station, its elevation, and what the axis misses it by."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from femflex.rotations import dcm_from_quaternion, dcm_from_vector
from femflex.system import Channel, Sight, System

Array = NDArray[np.float64]

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
        C_NB = dcm_from_quaternion(seen[f"bodies/{sight.body}/attitude"])
        r, axis = marker_and_axis(system, sight, seen[f"bodies/{sight.body}/delta"])
        place = seen[f"bodies/{sight.body}/position"] + np.einsum("tij,tj->ti", C_NB, r)
        pointed = np.einsum("tij,tj->ti", C_NB, axis)
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


def marker_and_axis(system: System, sight: Sight, delta: Array) -> tuple[Array, Array]:
    """Place (n_t, 3) of the marker and the axis (n_t, 3), turned along by exp(psi delta), in body components."""
    marker = system.bodies[sight.body].marker(sight.marker)
    axis = np.broadcast_to(marker.orientation @ sight.axis, (len(delta), 3))
    turned = np.einsum("tij,tj->ti", dcm_from_vector(delta @ marker.psi.T), axis)
    return marker.position + delta @ marker.phi.T, turned
