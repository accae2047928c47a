"""Build the orbit of a case."""

from __future__ import annotations

from femflex.case.orbit import OrbitTable
from femflex.system import Orbit


def build_orbit(table: OrbitTable) -> Orbit | None:
    """The Orbit of a table; None if the case has no orbit."""
    if table.kind == "none":
        return None
    shape = {
        key: getattr(table, key) for key in ("eccentricity", "inclination", "node", "perigee", "true_anomaly", "mu")
    }
    return Orbit(table.perigee_radius / (1.0 - table.eccentricity), free=table.kind == "free", **shape)
