"""What a specified orbit needs: the force that keeps O on it against the loads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from femflex.system import Channel, Load, System

Array = NDArray[np.float64]

PATH = "orbit/force"


def pushing(system: System) -> list[Load]:
    """Loads whose resultant would move O off a specified orbit."""
    if system.orbit is None or system.orbit.free:
        return []
    return [load for load in system.loads if np.any(load.force)]


def orbit_channels(system: System) -> dict[str, Channel]:
    """Path, unit and meaning of the force, where there is any."""
    meaning = "force that keeps O on the specified orbit against the loads"
    return {PATH: Channel("N", meaning, (3,), ("x", "y", "z"), "inertial")} if pushing(system) else {}


def observe_orbit_force(system: System, out: Mapping[str, Array]) -> dict[str, Array]:
    """Minus the resultant of the loads, inertial components (n_t, 3) [N], from what else is observed.

    The first moment of mass about O is zero, so the gravity gradient has no resultant (THEORY section 5).
    """
    loads = pushing(system)
    if not loads:
        return {}
    forces = [
        Rotation.from_quat(out[f"bodies/{load.body}/attitude"], scalar_first=True).apply(
            out[f"loads/{load.name}/force"]
        )
        for load in loads
    ]
    return {PATH: -np.sum(forces, axis=0)}
