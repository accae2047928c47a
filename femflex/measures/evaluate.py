"""Measured quantities of a run or of bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from femflex.arrays import Array
from femflex.measures.measure import OF_BODY, MeasureTable
from femflex.measures.tones import crossing_frequency, fitted_frequencies
from femflex.noun.problems import suggestion_text


class Record(Protocol):
    """Interface of a run: times, channels by path with names and units, and bodies (femflex.results.Run)."""

    @property
    def time(self) -> Array:
        """Instants (n_t,) [s]."""

    def __getitem__(self, path: str) -> Array: ...

    def names(self, path: str) -> tuple[str, ...]:
        """Names of the entries of a channel."""

    def unit(self, path: str) -> str:
        """Unit of a channel."""

    def bodies(self) -> Mapping[str, Any]:
        """Bodies with omega and mass by name."""


def measured_value(table: MeasureTable, run: Record, mean_motion: float | None = None) -> float:
    """The quantity, in SI (frequencies in Hz, or in units of the mean motion [rad/s] if `per_orbit`).

    Raises KeyError for an unknown channel, body or component, ValueError where the quantity has no meaning.
    """
    if table.of in OF_BODY:
        return _body_quantity(table, run.bodies())
    assert table.channel is not None
    time, values = run.time, np.asarray(run[table.channel], float)
    values = _component(table, values, run.names(table.channel))
    keep = np.ones(len(time), bool)
    if table.start is not None:
        keep &= time >= table.start - 1e-9 * abs(table.start)
    if table.end is not None:
        keep &= time <= table.end + 1e-9 * abs(table.end)
    if not keep.any():
        raise ValueError(f"no instant of the run lies between start = {table.start} s and end = {table.end} s")
    return _reduced_value(table, time[keep], values[keep], mean_motion)


def measured_unit(table: MeasureTable, run: Record) -> str:
    """Unit of the measured number."""
    if table.of in ("frequency", "mode_frequency"):
        return "per orbit" if table.per_orbit else "Hz"
    if table.of == "body_mass":
        return "kg"
    return "1" if table.relative else column_unit(table, run)


def column_unit(table: MeasureTable, run: Record) -> str:
    """Unit of the measured column; all units of the channel, where they differ and no component is named."""
    path = str(table.channel)
    units = run.unit(path).split(", ")
    if len(units) == 1 or table.component is None:
        return ", ".join(dict.fromkeys(units))
    names = run.names(path)
    column = names.index(table.component) if isinstance(table.component, str) else int(table.component)
    return units[column] if len(units) == len(names) else ", ".join(dict.fromkeys(units))


def _reduced_value(table: MeasureTable, time: Array, x: Array, mean_motion: float | None) -> float:
    size = np.abs(x) if x.ndim == 1 else np.linalg.norm(x, axis=1)
    if table.of == "frequency":
        if x.ndim > 1:
            raise ValueError(f"a frequency is that of one component of {table.channel!r}; name it in `component`")
        f = (
            crossing_frequency(time, x)
            if table.tones == 1
            else fitted_frequencies(time, x, table.tones)[table.tone - 1]
        )
        if table.per_orbit and mean_motion is None:
            raise ValueError("a frequency per orbit needs an orbit")
        return float(f * 2 * math.pi / mean_motion) if table.per_orbit and mean_motion else float(f)
    departure = np.abs(x - x[0]) if x.ndim == 1 else np.linalg.norm(x - x[0], axis=1)
    if table.of == "drift":
        return float(departure.max() / size.max() if table.relative and size.max() > 0 else departure.max())
    if table.of == "peak":
        return float(size.max())
    if table.of == "change":
        return float(x[-1] - x[0]) if x.ndim == 1 else float(departure[-1])
    x = x if x.ndim == 1 else size
    if table.of == "value":
        return float(np.interp(time[-1] if table.at is None else table.at, time, x))
    reductions: dict[str, Callable[[Array], Any]] = {
        "maximum": np.max,
        "minimum": np.min,
        "range": np.ptp,
        "mean": np.mean,
        "rms": lambda v: np.sqrt(np.mean(v**2)),
    }
    return float(reductions[table.of](x))


def _component(table: MeasureTable, values: Array, names: tuple[str, ...]) -> Array:
    if table.component is None:
        return values if values.ndim <= 2 else values.reshape(len(values), -1)
    if values.ndim < 2:
        raise KeyError(f"channel {table.channel!r} is a scalar; leave `component` out")
    n = values.shape[1]
    if isinstance(table.component, str):
        if table.component not in names:
            raise KeyError(
                f"component {table.component!r} is not in channel {table.channel!r}; "
                f"{suggestion_text(table.component, names)}"
            )
        return np.asarray(values[:, names.index(table.component)])
    if table.component >= n:
        raise KeyError(f"component {table.component} is not in channel {table.channel!r}, which has {n} (from 0)")
    return np.asarray(values[:, table.component])


def _body_quantity(table: MeasureTable, bodies: Mapping[str, Any]) -> float:
    segments = [body for name, body in bodies.items() if name.rpartition(".")[0] == table.body]  # segments
    if table.of == "body_mass" and segments:
        return float(sum(body.mass if hasattr(body, "mass") else body.moments.mass for body in segments))
    if table.body is None or table.body not in bodies:
        raise KeyError(f"body {table.body!r} is not in the run; {suggestion_text(str(table.body), bodies)}")
    body = bodies[table.body]
    if table.of == "body_mass":
        return float(body.mass if hasattr(body, "mass") else body.moments.mass)
    omega = np.asarray(body.omega)
    if table.mode > len(omega) or not np.isfinite(omega[table.mode - 1]):
        raise ValueError(
            f"mode {table.mode} of body {table.body!r} has no natural frequency; "
            f"{int(np.isfinite(omega).sum())} of its modes have one"
        )
    return float(omega[table.mode - 1] / (2 * math.pi))
