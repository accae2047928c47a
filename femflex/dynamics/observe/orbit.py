"""Force that keeps O on a specified orbit against the loads, and lines of sight to stations on the ground."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from femflex.arrays import Array
from femflex.dynamics.observe.markers import marker_motion
from femflex.dynamics.observe.row import XYZ
from femflex.dynamics.report import Observation, Report
from femflex.rotations import dcm_from_quaternion
from femflex.system import Channel, Effector, Load, System


class OrbitForce(Report):
    """Minus the resultant of loads and effectors.

    The first moment of mass about O is zero, so the gravity gradient has no resultant (THEORY section 5).
    """

    def channels(self, system: System) -> dict[str, Channel]:
        if not any(disturbing(system)):
            return {}
        text = "force that keeps O on the specified orbit against loads and effectors"
        return {"orbit/force": Channel("N", text, (3,), XYZ, "inertial")}

    def observe(self, seen: Observation) -> Iterable[Array]:
        (loads, effectors), forces = disturbing(seen.system), []
        for load in loads:
            turn = Rotation.from_quat(seen[f"bodies/{load.body}/attitude"], scalar_first=True)
            forces.append(turn.apply(seen[f"loads/{load.name}/force"]))
        for effector in effectors:  # inertial components already, three for each marker
            forces_at_markers = seen[f"effectors/{effector.name}/force"]
            forces.append(forces_at_markers.reshape(len(forces_at_markers), -1, 3).sum(axis=1))
        return [-np.sum(forces, axis=0)]


def disturbing(system: System) -> tuple[list[Load], list[Effector]]:
    """Loads, and effectors with forces at markers, whose resultant would move O off a specified orbit."""
    if system.orbit is None or system.orbit.free:
        return [], []
    effectors = [e for e in system.effectors if isinstance(e, Effector) and e.markers and "force" in e.exerts]
    return [load for load in system.loads if np.any(load.force)], effectors


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
