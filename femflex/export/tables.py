"""Channels of a run as tables: `.csv`, `.parquet`, `.mat` and `.nc`; and ephemerides: `.oem` and `.aem`."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.case.read import parse_case
from femflex.extras import require
from femflex.results import Run
from femflex.rotations import dcm_from_quaternion
from femflex.system.ccsds import Ephemeris, aem_text, oem_text
from femflex.writing import atomic_file

DIGITS = "%.17g"  # that give every number back


def write_csv(run: Run, path: str | Path, channels: Sequence[str] = (), force: bool = False) -> list[str]:
    """Write channels with a head of names and units, such as "q:hinge.angle [rad]". Returns what is worth saying.

    channels: paths; none for all. Raises KeyError for a channel that is not there, and OSError.
    """
    heads, columns = _table(run, channels)
    with atomic_file(path, force) as part, open(part, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(heads)
        writer.writerows([DIGITS % value for value in row] for row in np.column_stack(columns))
    return [_size(run, columns)]


def write_parquet(run: Run, path: str | Path, channels: Sequence[str] = (), force: bool = False) -> list[str]:
    """Write channels as an Apache Parquet table; otherwise as `write_csv`. Raises MissingExtra without pyarrow."""
    require("tables", "Parquet files", "pyarrow")
    import pyarrow
    from pyarrow import parquet

    heads, columns = _table(run, channels)
    with atomic_file(path, force) as part:
        parquet.write_table(pyarrow.table(dict(zip(heads, columns, strict=True))), part)
    return [_size(run, columns)]


def write_mat(run: Run, path: str | Path, channels: Sequence[str] = (), force: bool = False) -> list[str]:
    """Write channels as variables of a MATLAB file, "/" and other signs as "_"; `units` and `names` are structures.

    Otherwise as `write_csv`. Raises ValueError where two channels would have one name.
    """
    from scipy.io import savemat

    paths = _paths(run, channels)
    names = {path: re.sub(r"\W", "_", path) for path in ("time", *paths)}
    doubles = sorted(path for path in names if list(names.values()).count(names[path]) > 1)
    if doubles:
        raise ValueError(f"channels {doubles} have one name in MATLAB; export them one by one")
    variables: dict[str, Any] = {name: run[path] for path, name in names.items()}
    variables["units"] = {names[path]: run.unit(path) for path in names}
    entries = {names[path]: np.array(run.names(path), object) for path in paths if run.names(path)}
    if entries:
        variables["names"] = entries
    with atomic_file(path, force) as part:
        savemat(part, variables, long_field_names=True, oned_as="column")
    return [f"{len(run)} instants of {len(paths)} channels"]


def write_netcdf(run: Run, path: str | Path, channels: Sequence[str] = (), force: bool = False) -> list[str]:
    """Write channels as netCDF 4, as `Run.to_xarray` has them. Otherwise as `write_csv`.

    Raises MissingExtra without xarray and h5netcdf.
    """
    require("tables", "netCDF files", "xarray", "h5netcdf")
    paths = _paths(run, channels)
    with atomic_file(path, force) as part:
        run.to_xarray()[[channel.replace("/", ".") for channel in paths]].to_netcdf(part, engine="h5netcdf")
    return [f"{len(run)} instants of {len(paths)} channels"]


def _paths(run: Run, channels: Sequence[str]) -> list[str]:
    """The channels, checked; all where none is named. Raises KeyError."""
    for path in channels:
        run.unit(path)
    return list(channels or run)


def _table(run: Run, channels: Sequence[str]) -> tuple[list[str], list[Array]]:
    heads, columns = ["time [s]"], [run.time]
    for path in _paths(run, channels):
        values = run[path]
        flat = values.reshape(len(values), int(np.prod(values.shape[1:])))
        heads += [f"{path}{entry} [{unit}]" for entry, unit in _entries(run, path, values.shape[1:])]
        columns += list(flat.T)
    return heads, columns


def _entries(run: Run, path: str, shape: tuple[int, ...]) -> Iterator[tuple[str, str]]:
    """Suffix such as ":x" and unit of each number of a channel, in the order of its memory."""
    names, units = run.names(path), run.units(path)
    for index in np.ndindex(shape):
        words = [str(k + 1) for k in index]
        if names:
            words[-1] = names[index[-1]]
        yield "".join(f":{word}" for word in words), units[index[-1]] if index else units[0]


def _size(run: Run, columns: Sequence[Array]) -> str:
    return f"{len(run)} rows of {len(columns)} columns"


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
