"""Cases whose orbit or attitude is in an ephemeris file: its elements and epoch at the start, as of the tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from femflex.noun.problems import Problem
from femflex.system.ccsds import read_aem
from femflex.system.environment import days_since_j2000
from femflex.system.ephemeris_orbit import starting_elements

SIZES = ("perigee_altitude", "semi_major_axis", "eccentricity", "inclination", "node", "perigee", "true_anomaly")


class EphemerisError(Exception):
    """An ephemeris file that cannot be read."""

    def __init__(self, key: str, text: str) -> None:
        super().__init__(text)
        self.problem = Problem(key, text)


def with_ephemerides(tables: Mapping[str, Any] | None, folder: Path) -> dict[str, Any] | None:
    """The tables of a case, in which an orbit of a file has its elements and the environment its epoch.

    Raises EphemerisError for a file that cannot be read, and for elements beside it.
    """
    if tables is None:
        return None
    out = dict(tables)
    orbit, attitude = (_file_of(tables, key) for key in ("orbit", "attitude"))
    if orbit is None and attitude is None:
        return out
    environment = tables.get("environment", {})
    epoch = environment.get("epoch") if isinstance(environment, Mapping) else environment.epoch
    key = "orbit"
    try:
        days = None if epoch is None else days_since_j2000(epoch)
        if orbit is not None and isinstance(out["orbit"], Mapping):
            if given := [name for name in SIZES if name in out["orbit"]]:
                raise ValueError(f"found ephemeris together with {', '.join(given)}; give one or the other")
            mu = out["orbit"].get("mu")
            elements, days = starting_elements(folder / orbit, days, *([float(mu)] if mu is not None else []))
            out["orbit"] = {**out["orbit"], **elements}
        key = "attitude"
        if attitude is not None:
            days = float(read_aem(folder / attitude).days[0]) if days is None else days
            if isinstance(out["attitude"], Mapping):
                out["attitude"] = {**out["attitude"], "frame": out["attitude"].get("frame", "inertial")}
    except (ValueError, OSError) as error:
        raise EphemerisError(f"{key}.ephemeris", str(error)) from None
    if epoch is None and days is not None and isinstance(environment, Mapping):
        out["environment"] = {**environment, "epoch": days}
    return out


def _file_of(tables: Mapping[str, Any], key: str) -> str | None:
    table = tables.get(key)
    name = table.get("ephemeris") if isinstance(table, Mapping) else getattr(table, "ephemeris", None)
    return name if isinstance(name, str) else None
