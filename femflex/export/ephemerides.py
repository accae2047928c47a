"""Orbit and attitude of a run as ephemeris messages of CCSDS: `.oem` and `.aem`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.case.read import parse_case
from femflex.results import Run
from femflex.rotations import dcm_from_quaternion
from femflex.system.ccsds import Ephemeris, aem_text, oem_text
from femflex.writing import atomic_file

SECONDS = 86400.0
OF_DATE = "MOD_EARTH"  # mean equator and equinox of the epoch: the inertial axes of a case with one


def write_oem(run: Run, path: str | Path, channels: Sequence[str] = (), force: bool = False) -> list[str]:
    """Write the centre of mass of a run in orbit as an orbit ephemeris message. Returns what is worth saying, as lines.

    Velocities are rates of a spline of degree 5 through the positions. Raises ValueError for a run without orbit or
    epoch, for channels, and for fewer than 6 rows; and OSError.
    """
    _refuse_channels(path, channels)
    if "orbit/radius" not in run:
        raise ValueError(f"{run.path} has no orbit, so there is no orbit ephemeris of it")
    from scipy.interpolate import make_interp_spline

    days, text = _days(run)
    C_NO = dcm_from_quaternion(run["orbit/attitude"])
    position = C_NO[:, :, 1] * run["orbit/radius"][:, None] + run["monitors/center_of_mass"]
    if len(position) < 6:
        raise ValueError(f"{run.path} has {len(position)} rows; velocities of an ephemeris need 6")
    velocity = make_interp_spline(run.time, position, 5).derivative()(run.time)
    message = Ephemeris(days, np.hstack([position, velocity]), OF_DATE)
    with atomic_file(path, force) as part:
        part.write_text(oem_text(message, text, Path(run.path).stem), encoding="utf-8")
    return [f"{len(days)} positions of the centre of mass, axes {OF_DATE}"]


def write_aem(run: Run, path: str | Path, channels: Sequence[str] = (), force: bool = False) -> list[str]:
    """Write the attitude of a body, by default of the root, as an attitude ephemeris message, as lines.

    channels: at most one, "bodies/NAME/attitude". Raises ValueError for a run without an epoch, and for other channels;
    and OSError.
    """
    named = list(channels) or [f"bodies/{_root(run)}/attitude"]
    if len(named) > 1 or not named[0].endswith("/attitude") or not named[0].startswith("bodies/"):
        raise ValueError(f"an attitude ephemeris is of one body: bodies/NAME/attitude; found {', '.join(named)}")
    days, text = _days(run)
    with atomic_file(path, force) as part:
        message = Ephemeris(days, run[named[0]], OF_DATE)
        part.write_text(aem_text(message, text, named[0].split("/")[1]), encoding="utf-8")
    return [f"{len(days)} attitudes of {named[0].split('/')[1]}, axes {OF_DATE}"]


def _days(run: Run) -> tuple[Array, str]:
    """Days since J2000 of every row, and the title of the case. Raises ValueError without an epoch."""
    case = parse_case(run.case_text, Path(run.path))
    if case.environment.epoch is None:
        raise ValueError("an ephemeris has dates; give environment.epoch in the case, and run it again")
    return case.environment.epoch + run.time / SECONDS, case.title or Path(run.path).stem


def _root(run: Run) -> str:
    """The first body of the run."""
    return next(path.split("/")[1] for path in run if path.startswith("bodies/") and path.endswith("/attitude"))


def _refuse_channels(path: str | Path, channels: Sequence[str]) -> None:
    if channels:
        raise ValueError(f"{Path(path).name} has the orbit of the centre of mass; leave {', '.join(channels)} out")
