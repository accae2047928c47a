"""Orbits that follow an ephemeris file, and osculating elements of a position and velocity."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.system.ccsds import Ephemeris, read_oem
from femflex.system.orbit import MU_EARTH, Orbit
from femflex.system.profile import Profile
from femflex.system.two_line import epoch_of, two_line_ephemeris, two_line_record

STEP = 30.0  # s, of SGP4's states, between which a spline of degree 5 goes
MARGIN = 6  # of these steps before and after a run, where the spline begins and ends
SECONDS = 86400.0
VELOCITY = (
    1e-3  # of the velocity by which that of a file may differ from the rate of its positions; SGP4 differs by 2e-4
)


def starting_elements(path: Path, epoch: float | None, mu: float = MU_EARTH) -> tuple[dict[str, float], float]:
    """Osculating elements at the start, with the names of [orbit], and the epoch of the start in days since J2000.

    epoch: of t = 0; by default the first of the file, or that of its two-line elements. Raises ValueError.
    """
    if _is_oem(path):
        ephemeris = read_oem(path)
        start = float(ephemeris.days[0]) if epoch is None else epoch
        r, v = _state_at(_splines(ephemeris, start, path), 0.0, path)
    else:
        record = two_line_record(path)
        start = epoch_of(record) if epoch is None else epoch
        r, v = two_line_ephemeris(record, np.array([start])).values[0].reshape(2, 3)
    return osculating_elements(r, v, mu), start


def followed_orbit(orbit: Orbit, path: Path, epoch: float, duration: float) -> Orbit:
    """The orbit with the positions of a file over a duration [s] from an epoch [days since J2000].

    Raises ValueError for a file that does not cover it.
    """
    if _is_oem(path):
        ephemeris = read_oem(path)
    else:
        seconds = STEP * np.arange(-MARGIN, int(np.ceil(duration / STEP)) + MARGIN + 1)
        days = np.array(epoch + seconds / SECONDS, float)
        ephemeris = two_line_ephemeris(two_line_record(path), days)
    splines = _splines(ephemeris, epoch, path)
    first, last = splines[0].first, splines[0].last
    if first > 1e-3 or last < duration - 1e-3:
        raise ValueError(
            f"{path.name} goes from {first:.6g} to {last:.6g} s of the run, which lasts {duration:.6g} s; give one "
            "that covers it, another environment.epoch, or a shorter run"
        )
    return orbit.along_path(splines)


def osculating_elements(r: Array, v: Array, mu: float = MU_EARTH) -> dict[str, float]:
    """Elements [m, rad] of the ellipse of a position [m] and velocity [m/s], with the names of [orbit].

    Raises ValueError for an open orbit.
    """
    h = np.cross(r, v)
    e_vector = np.cross(v, h) / mu - r / np.linalg.norm(r)
    energy = v @ v / 2.0 - mu / np.linalg.norm(r)
    if energy >= 0.0:
        raise ValueError(f"position {r.tolist()} m and velocity {v.tolist()} m/s are those of an open orbit")
    e = float(np.linalg.norm(e_vector))
    normal = h / np.linalg.norm(h)
    line = np.array([-normal[1], normal[0], 0.0])  # to the ascending node; X where the orbit is equatorial
    line = line / np.linalg.norm(line) if np.linalg.norm(line) > 1e-12 else np.array([1.0, 0.0, 0.0])
    apse = e_vector / e if e > 1e-12 else line

    def angle(of: Array, start: Array) -> float:
        return float(np.arctan2(np.cross(start, of) @ normal, start @ of))

    return {
        "semi_major_axis": float(-mu / (2.0 * energy)),
        "eccentricity": e,
        "inclination": float(np.arccos(np.clip(normal[2], -1.0, 1.0))),
        "node": float(np.arctan2(line[1], line[0])),
        "perigee": angle(apse, line),
        "true_anomaly": angle(r, apse),
    }


def _is_oem(path: Path) -> bool:
    with open(path, encoding="utf-8", errors="replace") as file:
        return "CCSDS_OEM_VERS" in file.read(4000)


def _splines(ephemeris: Ephemeris, epoch: float, path: Path) -> tuple[Profile, Profile, Profile]:
    """Splines of degree 5 through the positions, over seconds from the epoch. Raises ValueError for bad velocities."""
    seconds = (ephemeris.days - epoch) * SECONDS
    x, y, z = (Profile.spline(seconds, column, degree=5) for column in ephemeris.values[:, :3].T)
    inner = slice(len(seconds) // 3, max(len(seconds) // 3 + 1, 2 * len(seconds) // 3))
    rates = np.column_stack([p(seconds[inner])[1] for p in (x, y, z)])
    given = ephemeris.values[inner, 3:]
    difference = float(np.abs(rates - given).max() / np.abs(given).max())
    if difference > VELOCITY:
        raise ValueError(
            f"the velocities of {path.name} differ from the rates of its positions by {difference:.1e} of their size "
            f"(limit {VELOCITY:g}); give rows closer to each other, in inertial axes"
        )
    return x, y, z


def _state_at(splines: tuple[Profile, ...], t: float, path: Path) -> tuple[Array, Array]:
    values = np.array([p(t)[:2] for p in splines])
    if not np.isfinite(values).all():
        raise ValueError(f"{path.name} does not cover environment.epoch, at which the run starts")
    return values[:, 0], values[:, 1]
