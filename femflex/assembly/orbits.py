"""Table of the orbit -> Orbit."""

from __future__ import annotations

from femflex.case.orbit import OrbitTable
from femflex.system import Orbit


def build_orbit(table: OrbitTable) -> Orbit | None:
    """The orbit, or None."""
    if table.kind == "none":
        return None
    shape = {
        key: getattr(table, key) for key in ("eccentricity", "inclination", "node", "perigee", "true_anomaly", "mu")
    }
    return Orbit(table.perigee_radius / (1.0 - table.eccentricity), free=table.kind == "free", **shape)
