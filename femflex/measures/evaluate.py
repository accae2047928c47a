"""Measured quantities of a run or of bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from femflex.arrays import Array
from femflex.measures.measure import OF_BODY, MeasureTable
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


def crossing_frequency(time: Array, signal: Array) -> float:
    """Frequency [Hz] of a signal (n_t,) from the upward crossings of its mean, each placed by a cubic through four
    samples.

    For one dominant oscillation of any shape. Raises ValueError when there are fewer than two crossings.
    """
    x = signal - signal.mean()
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    if len(up) < 2:
        raise ValueError(
            f"the signal crosses its mean upwards {len(up)} times; a frequency needs at least two crossings, so a "
            f"longer run"
        )
    instants = np.array([_crossing(time, x, k) for k in (up[0], up[-1])])
    return float((len(up) - 1) / (instants[1] - instants[0]))


def _crossing(time: Array, x: Array, k: int) -> float:
    """The zero of the cubic through the samples around k, between samples k and k + 1."""
    start = min(max(k - 1, 0), len(x) - 4)
    window = slice(start, start + 4)
    t = time[window] - time[k]
    c = np.polynomial.polynomial.polyfit(t, x[window], 3)
    roots = np.polynomial.polynomial.polyroots(c)
    real = roots[np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots.real))].real
    inside = real[(real >= -1e-12) & (real <= (time[k + 1] - time[k]) * (1 + 1e-12))]
    linear = -x[k] * (time[k + 1] - time[k]) / (x[k + 1] - x[k])
    return float(time[k] + (inside[np.argmin(np.abs(inside - linear))] if len(inside) else linear))


def fitted_frequencies(time: Array, signal: Array, tones: int) -> Array:
    """Frequencies (n,) [Hz], ascending, of the best fit of the signal by this many sinusoids and a constant.

    Each sinusoid starts at the highest peak in the spectrum of the residual of the earlier ones; then all are fitted
    together by variable projection (amplitudes solved for linearly). Exact for such a signal; needs a few periods and
    no aliasing.
    """
    from scipy.optimize import least_squares

    time = time - time.mean()
    omegas, scale = np.zeros(0), 2 * np.pi / float(np.ptp(time))
    for _ in range(tones):
        omegas = np.append(omegas, _peak(time, _residual(omegas, time, signal)))
        fit = least_squares(
            _scaled_residual,
            omegas / scale,
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=200,
            args=(scale, time, signal),
        )
        omegas = fit.x * scale
    return np.asarray(np.sort(np.abs(omegas)) / (2 * np.pi))


def _residual(omega: Array, time: Array, signal: Array) -> Array:
    """Residual of the best fit by sinusoids of these frequencies and a constant, relative to the signal's range."""
    A = np.concatenate([np.ones((len(time), 1)), np.cos(np.outer(time, omega)), np.sin(np.outer(time, omega))], axis=1)
    size = np.ptp(signal)
    return np.asarray((signal - A @ np.linalg.lstsq(A, signal, rcond=None)[0]) / (size if size > 0 else 1.0))


def _scaled_residual(periods: Array, scale: float, time: Array, signal: Array) -> Array:
    """The residual over frequencies in periods per record, which makes them of order one."""
    return _residual(periods * scale, time, signal)


def _peak(time: Array, signal: Array) -> float:
    """Angular frequency of the highest peak of a padded, windowed spectrum of evenly spaced samples."""
    n = 8 * len(time)
    spectrum = np.abs(np.fft.rfft(signal * np.hanning(len(time)), n))
    spectrum[0] = 0.0
    return float(2 * np.pi * np.argmax(spectrum) / (n * (time[-1] - time[0]) / (len(time) - 1)))
