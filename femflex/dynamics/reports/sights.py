"""Lines of sight: direction and distance of the station, its elevation, the axis' pointing error."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.reports.markers import marker_motion
from femflex.dynamics.reports.report import Observation, Report
from femflex.dynamics.reports.row import XYZ
from femflex.rotations import dcm_from_quaternion
from femflex.system import Channel, System


class Sights(Report):
    """Every line of sight, from the motion of its marker and the orbit."""

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for sight in system.sights:
            path, where = f"sights/{sight.name}", f"{sight.body}.{sight.marker}"
            out[f"{path}/error"] = Channel("rad", f"angle from the axis of {where} to the station")
            out[f"{path}/range"] = Channel("m", f"distance of the station from {where}")
            out[f"{path}/elevation"] = Channel("rad", f"elevation of {where} over the station's horizon")
            out[f"{path}/position"] = Channel("m", f"place of {where} from O", (3,), XYZ, "inertial")
            out[f"{path}/direction"] = Channel("1", f"unit vector from {where} to the station", (3,), XYZ, "inertial")
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        for sight in seen.system.sights:
            position, C_NM = marker_motion(seen.system, seen.times, seen, sight.body, sight.marker)
            pointed = C_NM @ sight.axis
            up = dcm_from_quaternion(seen["orbit/attitude"])[:, :, 1]
            station = sight.station(seen.times)
            to_station = station - seen["orbit/radius"][:, None] * up - position
            distance = np.linalg.norm(to_station, axis=1)
            direction = to_station / distance[:, None]
            sine = np.linalg.norm(np.cross(pointed, direction), axis=1)
            yield np.arctan2(sine, np.einsum("ti,ti->t", pointed, direction))
            yield distance
            yield np.arcsin(-np.einsum("ti,ti->t", direction, station / sight.radius))
            yield from (position, direction)
