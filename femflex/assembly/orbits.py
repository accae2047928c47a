"""Build the orbit and the environment of a case."""

from __future__ import annotations

from femflex.case.case import Case
from femflex.system import Environment, Orbit


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


def build_environment(case: Case) -> Environment:
    """The Environment of a case, with the radius of its orbit if it has none of its own."""
    environment = case.environment
    has_radius = "radius" in environment.model_fields_set
    return environment if has_radius else environment.model_copy(update={"radius": case.orbit.radius})
