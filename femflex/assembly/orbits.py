"""Build the orbit of a case."""

from __future__ import annotations

from femflex.case.case import Case
from femflex.system import Orbit


def build_orbit(case: Case) -> Orbit | None:
    """The Orbit of a case; None if it has none."""
    table = case.orbit
    if table.kind == "none":
        return None
    shape = {
        key: getattr(table, key) for key in ("eccentricity", "inclination", "node", "perigee", "true_anomaly", "mu")
    }
    orbit = Orbit(table.perigee_radius / (1.0 - table.eccentricity), free=table.kind == "free", **shape)
    return orbit.with_secular_rates(case.environment.oblateness[0], table.radius) if table.secular_rates else orbit
