"""Channels of a run as tables: `.csv`, `.parquet`, `.mat` and `.nc`."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.extras import require
from femflex.results import Run
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
