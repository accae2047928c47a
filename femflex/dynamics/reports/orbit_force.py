"""Force that keeps O on a specified orbit against the loads."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from femflex.arrays import Array
from femflex.dynamics.reports.report import Observation, Report
from femflex.dynamics.reports.row import XYZ
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
