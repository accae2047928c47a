"""Force that keeps O on a specified orbit against the loads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from femflex.arrays import Array
from femflex.system import Channel, Effector, Load, System

PATH = "orbit/force"


def disturbing_loads(system: System) -> list[Load]:
    """Loads whose resultant would move O off a specified orbit."""
    if system.orbit is None or system.orbit.free:
        return []
    return [load for load in system.loads if np.any(load.force)]


def disturbing_effectors(system: System) -> list[Effector]:
    """Effectors whose forces at markers would move O off a specified orbit."""
    if system.orbit is None or system.orbit.free:
        return []
    acting = (effector for effector in system.effectors if isinstance(effector, Effector) and effector.markers)
    return [effector for effector in acting if "force" in effector.exerts]


def orbit_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of the force, where there is any."""
    meaning = "force that keeps O on the specified orbit against loads and effectors"
    return (
        {PATH: Channel("N", meaning, (3,), ("x", "y", "z"), "inertial")}
        if disturbing_loads(system) or disturbing_effectors(system)
        else {}
    )


def observe_orbit_force(system: System, out: Mapping[str, Array]) -> dict[str, Array]:
    """Minus the resultant of loads and effectors, inertial components (n_t, 3) [N], from what else is observed.

    The first moment of mass about O is zero, so the gravity gradient has no resultant (THEORY section 5).
    """
    loads, effectors = disturbing_loads(system), disturbing_effectors(system)
    if not (loads or effectors):
        return {}
    forces = [
        Rotation.from_quat(out[f"bodies/{load.body}/attitude"], scalar_first=True).apply(
            out[f"loads/{load.name}/force"]
        )
        for load in loads
    ]
    for effector in effectors:  # inertial components already, three for each marker
        forces_at_markers = out[f"effectors/{effector.name}/force"]
        forces.append(forces_at_markers.reshape(len(forces_at_markers), -1, 3).sum(axis=1))
    return {PATH: -np.sum(forces, axis=0)}
