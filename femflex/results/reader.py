"""Run: reader of a result file."""

from __future__ import annotations

import difflib
import html
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Skin
from femflex.body.strain_field import StrainPart, read_field, write_field
from femflex.extras import require
from femflex.hdf5 import open_hdf5
from femflex.noun.names import name_problems
from femflex.reading import reading
from femflex.results.checks import check_layout
from femflex.results.layout import FORMAT, LAYOUT, channel_of, channels_of
from femflex.system.channel import Channel

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class RunBody:
    """Data of a body that a result file contains.

    mass [kg], kinds (n,), omega (n,) [rad/s], markers name -> undeformed position (3,) [m, body frame],
    skin  None for a body that cannot be drawn;  strain_field  parts that recover its strain
    """

    mass: float
    kinds: tuple[str, ...]
    omega: Array
    markers: dict[str, Array]
    skin: Skin | None
    strain_field: tuple[StrainPart, ...] = ()

    @property
    def n_modes(self) -> int:
        """Number of shapes."""
        return len(self.omega)


def write_bodies(group: h5py.Group, bodies: dict[str, FlexibleBody]) -> None:
    """Write every body under its name."""
    for name, body in bodies.items():
        _check_name(name)
        body_group = group.create_group(name)
        body_group.attrs["mass"] = float(body.moments.mass)
        body_group.attrs["n_modes"] = body.n_shapes
        body_group["omega"] = np.asarray(body.omega, float) if len(body.omega) else np.full(body.n_shapes, np.nan)
        body_group.create_dataset("kinds", data=np.array(body.kinds, dtype=object), dtype=h5py.string_dtype())
        markers = body_group.create_group("markers")
        for marker, marker_data in body.markers.items():
            markers[marker] = marker_data.position
        if body.skin is not None:
            body_group["points"], body_group["shapes"] = body.skin.points, body.skin.shapes
            if body.skin.growth is not None:
                body_group["growth"] = body.skin.growth
            cells = body_group.create_group("cells")
            for kind, nodes in body.skin.cells.items():
                cells[kind] = nodes
        write_field(body_group, body.strain_field)


def read_body(group: h5py.Group) -> RunBody:
    """One body of /model."""
    skin = None
    if "points" in group:
        cells = {kind: np.asarray(nodes[()], np.int64) for kind, nodes in group["cells"].items()}
        growth = group["growth"][()] if "growth" in group else None
        skin = Skin(group["points"][()], cells, group["shapes"][()], growth)
        if not all(np.isfinite(values).all() for values in (skin.points, skin.shapes)):
            raise ValueError(f"the points or shapes of {group.name} have values that are not finite")
    return RunBody(
        float(group.attrs["mass"]),
        tuple(group["kinds"].asstr()[()]),
        group["omega"][()],
        {name: position[()] for name, position in group["markers"].items()},
        skin,
        read_field(group),
    )


def _check_name(name: str) -> None:
    for problem in name_problems("body", [name]):
        raise ValueError(problem)


__all__ = ["Run", "RunBody", "open_file", "open_run"]

SHOWING = "femflex.notebook"  # in a layer above, so it is loaded by its name when a run is to show itself
KIND, ADVICE = "result file", "Take an unchanged copy, or run the case anew."


def open_run(path: str | Path) -> Run:
    """The run in a result file, finished or not; close it, or use it in a `with` statement.

    Raises FileNotFoundError, and ValueError for a file that is not a result file.
    """
    return Run(open_file(Path(path)), Path(path))


def open_file(path: Path) -> h5py.File:
    """The HDF5 file of a run, checked, open for reading (also while a run is writing it)."""
    with reading(path, KIND, ADVICE):
        file = open_hdf5(path, KIND)
        try:
            _check(file, path)
        except BaseException:
            file.close()
            raise
        return file


def _check(file: h5py.File, path: Path) -> None:
    format_name, layout = file.attrs.get("format"), file.attrs.get("layout")
    if format_name != FORMAT:
        raise ValueError(f"{path} is an HDF5 file, but not a result file: its attribute `format` is not {FORMAT!r}")
    if not isinstance(layout, int | np.integer):
        raise ValueError(f"{path} is damaged or was edited: its attribute `layout` is not a whole number")
    if layout > LAYOUT:
        writer = file.attrs.get("femflex_version")
        raise ValueError(
            f"{path} has layout {layout}, written by femflex {writer}; this version reads layouts up to {LAYOUT}"
        )
    check_layout(file, path)


class Run:
    """A run as read from its file: `run.time`, `run["bodies/panel/position"]`; arrays are read on request.

    >>> with open_run("run.h5") as run:  # doctest: +SKIP
    ...     angles = run["attitude/angles"]  # (n_t, 3)
    ...     run.names("attitude/angles"), run.unit("attitude/angles")
    """

    def __init__(self, file: h5py.File, path: Path) -> None:
        self.file = file
        self.path = path
        self._data = channels_of(file)
        self._rows = int(file["progress"][0])

    @cached_property
    def time(self) -> Array:
        """Instants of the rows, (n_t,) [s]."""
        return self.read("time")

    @cached_property
    def channels(self) -> dict[str, Channel]:
        """Path -> Channel of every array over time."""
        return {path: channel_of(data) for path, data in self._data.items() if path != "time"}

    def __getitem__(self, path: str) -> Array:
        return self.read(path)

    def read(self, path: str, rows: slice = slice(None)) -> Array:
        """The array of a channel, or some rows of it, (n_t, *shape).

        Raises KeyError with the nearest paths when there is none of that name.
        """
        data = self._data_set(path)
        with reading(self.path, KIND, ADVICE):
            return np.asarray(data[slice(*rows.indices(self._rows))], float)

    def finite(self, path: str, rows: slice = slice(None)) -> Array:
        """Read a channel as `read` does, for use where every value must be a number.

        Raises ValueError for a run without instants, and where a value is not finite, with its time.
        """
        if not self._rows:
            raise ValueError(f"{self.path} holds no instants")
        values = self.read(path, rows)
        good = np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
        if not good.all():
            t = self.read("time", rows)[int(np.argmin(good))]
            raise ValueError(
                f"channel {path!r} of {self.path} has values that are not finite, the first at t = {t:g} s"
            )
        return values

    def states(self, rows: slice = slice(None)) -> Array:
        """The states x = (q, u, z) (n_t, n_x) of some rows. Raises ValueError where they are not finite."""
        return np.hstack([self.finite(path, rows) for path in ("q", "u", "z") if path in self])

    def __contains__(self, path: object) -> bool:
        return path in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __len__(self) -> int:
        """Number of instants."""
        return self._rows

    def unit(self, path: str) -> str:
        """Unit of a channel; for columns of several units, all of them separated by ", "."""
        return str(self._data_set(path).attrs["unit"])

    def units(self, path: str) -> tuple[str, ...]:
        """Unit of every entry along the last axis."""
        shape, unit = self._data_set(path).shape[1:], self.unit(path)
        column_units = tuple(unit.split(", "))
        count = shape[-1] if shape else 1
        return column_units if len(column_units) == count else (unit,) * count

    def names(self, path: str) -> tuple[str, ...]:
        """Names of the entries along the last axis, () where they have none."""
        return tuple(str(name) for name in self._data_set(path).attrs["names"])

    def bodies(self) -> dict[str, RunBody]:
        """The bodies by name, with what is needed to draw them."""
        with reading(self.path, KIND, ADVICE):
            return {name: read_body(group) for name, group in self._opened()["model"].items()}

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the file: title, case_text, complete, ended, integrator, ..."""
        return _plain(self._opened().attrs)

    @property
    def title(self) -> str:
        """Title of the case, or ""."""
        return str(self.attributes["title"])

    @property
    def case_text(self) -> str:
        """Text of the case file that was run, or ""."""
        return str(self.attributes["case_text"])

    @property
    def without(self) -> tuple[str, ...]:
        """Names of the terms that were switched off in the run, () for a full run."""
        return tuple(filter(None, str(self.attributes.get("without", "")).split(", ")))

    @property
    def linearised(self) -> bool:
        """Whether the run solved the linear equations (`run --linearised`)."""
        return str(self.attributes.get("integrator", "")) == "linearised"

    @property
    def complete(self) -> bool:
        """Whether the run reached its end."""
        return bool(self.attributes["complete"])

    @property
    def ended(self) -> str:
        """Text that says how the run ended; "" while it has not ended."""
        return str(self.attributes["ended"])

    @property
    def versions(self) -> dict[str, str]:
        """Versions of femflex, Python and the libraries that made the run."""
        return {"femflex": str(self.attributes["femflex_version"]), **dict(self._opened()["versions"].attrs)}

    @property
    def statistics(self) -> dict[str, Any]:
        """Counts of the integrator: steps, evaluations, ..."""
        counts = _plain(self._opened()["statistics"].attrs)
        return {name: count for name, count in counts.items() if name != "description"}

    @property
    def duration(self) -> float:
        """Time from the first to the last row [s]."""
        return float(self.time[-1] - self.time[0]) if len(self) else 0.0

    def to_xarray(self) -> xarray.Dataset:
        """All channels as an xarray Dataset over time, with units, descriptions and names ("/" becomes ".")."""
        return dataset(self)

    def view(self, time: float | None = None, **look: Any) -> Any:
        """The run at an instant [s], in a notebook: a view that turns where trame is installed, else a picture.

        time: by default that of the largest elastic displacement;  look: the fields of `femflex.view.Look`
        """
        return import_module(SHOWING).view(self, time, **look)

    def plot(self, *channels: str, path: str | Path | None = None, **options: Any) -> Path:
        """A picture of channels over time, which a notebook shows; options: of `femflex.view.plot_histories`."""
        return import_module(SHOWING).plot(self, channels, path, **options)

    def report(self, path: str | Path | None = None, force: bool = False) -> Path:
        """The report of `femflex report`, an HTML file that a notebook shows."""
        return import_module(SHOWING).report(self, path, force)

    def close(self) -> None:
        """Close the file."""
        self.file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        from femflex.results.layout import outline

        return outline(self) if self.file else f"{self.path} (closed)"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self))}</pre>"

    def _opened(self) -> h5py.File:
        if not self.file:
            raise ValueError(f"{self.path} has been closed; open the run again")
        return self.file

    def _data_set(self, path: str) -> h5py.Dataset:
        self._opened()
        if path not in self._data:
            raise KeyError(f"{path!r} is not in {self.path}; {_near_paths_text(path, list(self._data))}")
        return self._data[path]


def _plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    plain = {key: value.item() if isinstance(value, np.generic) else value for key, value in attributes.items()}
    return {key: value.decode() if isinstance(value, bytes) else value for key, value in plain.items()}


def _near_paths_text(path: str, paths: list[str]) -> str:
    matches = difflib.get_close_matches(path, paths, n=4, cutoff=0.5)
    matches += [k for k in paths if path.strip("/") and path.strip("/") in k and k not in matches][:4]
    if matches:
        return f"near it are {matches}"
    return f"it holds {paths}" if len(paths) <= 12 else f"its groups are {sorted({k.split('/')[0] for k in paths})}"


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
