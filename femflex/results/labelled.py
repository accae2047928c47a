"""A run as an xarray Dataset (the only module that imports xarray)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from femflex.extras import require

if TYPE_CHECKING:
    import xarray

    from femflex.results.reader import Run


def dataset(run: Run) -> xarray.Dataset:
    """All channels over the coordinate time.

    A variable is named by its path with "." for "/" (so that the Dataset can be saved as netCDF). Entries with the
    same names share one dimension, with the names as its coordinate. Raises MissingExtra.
    """
    require("xarray", "labelled datasets")
    import xarray

    coordinates: dict[str, Any] = {"time": ("time", run.time, {"units": "s"})}
    variables: dict[str, Any] = {}
    for path, channel in run.channels.items():
        dims = ["time", *(f"size_{size}" for size in channel.shape)]
        if channel.names:
            dims[-1] = _dimension(path, channel.names)
            coordinates[dims[-1]] = (dims[-1], list(channel.names))
        attrs = {"units": channel.unit, "description": channel.description, "frame": channel.frame}
        variables[path.replace("/", ".")] = (dims, run[path], attrs)
    attributes = {key: int(value) if isinstance(value, bool) else value for key, value in run.attributes.items()}
    return xarray.Dataset(variables, coordinates, attributes)


def _dimension(path: str, names: tuple[str, ...]) -> str:
    return "_".join(names) if len(names) <= 4 else path.replace("/", ".") + "_name"
