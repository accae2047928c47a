"""Measured quantities of a run or of bodies, and whether the case's expectations hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from femflex.case.case import Case
from femflex.case.measure import OF_BODY, ExpectTable, MeasureTable
from femflex.case.problems import near
from femflex.case.tones import crossing_frequency, fitted_frequencies
from femflex.case.units import UnitError, to_base

Array = NDArray[np.float64]


class Record(Protocol):
    """What is asked of a run: times, channels by path with names and units, and bodies (femflex.results.Run)."""

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


@dataclass(frozen=True)
class Verdict:
    """An expectation, what was measured, and whether it holds."""

    name: str
    found: float
    expected: str
    holds: bool
    unit: str

    def __str__(self) -> str:
        return (
            f"{self.name}: {self.found:.10g} {self.unit}, expected {self.expected}: "
            f"{'holds' if self.holds else 'does not hold'}"
        )


def judged(case: Case, run: Record) -> list[Verdict]:
    """The verdict on every entry of the case's [expect] table.

    Raises ValueError or KeyError for a quantity the run does not have.
    """
    return [_judge(name, table, run, _mean_motion(case)) for name, table in case.expect.answers.items()]


def measured(table: MeasureTable, run: Record, mean_motion: float | None = None) -> float:
    """The quantity, in SI (frequencies in Hz, or in units of the mean motion [rad/s] when asked per orbit).

    Raises KeyError for an unknown channel, body or component, ValueError where the quantity has no meaning.
    """
    if table.of in OF_BODY:
        return _of_body(table, run.bodies())
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
    return _reduced(table, time[keep], values[keep], mean_motion)


def measured_unit(table: MeasureTable, run: Record) -> str:
    """Unit of the measured number."""
    if table.of in ("frequency", "mode_frequency"):
        return "per orbit" if table.per_orbit else "Hz"
    if table.of == "body_mass":
        return "kg"
    return "1" if table.relative else column_unit(table, run)


def column_unit(table: MeasureTable, run: Record) -> str:
    """Unit of the measured column, of those that its channel lists where they differ; the whole list without one."""
    path = str(table.channel)
    units = run.unit(path).split(", ")
    if len(units) == 1 or table.component is None:
        return ", ".join(dict.fromkeys(units))
    names = run.names(path)
    column = names.index(table.component) if isinstance(table.component, str) else int(table.component)
    return units[column] if len(units) == len(names) else ", ".join(dict.fromkeys(units))


def _reduced(table: MeasureTable, time: Array, x: Array, mean_motion: float | None) -> float:
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
    away = np.abs(x - x[0]) if x.ndim == 1 else np.linalg.norm(x - x[0], axis=1)
    if table.of == "drift":
        return float(away.max() / size.max() if table.relative and size.max() > 0 else away.max())
    if table.of == "peak":
        return float(size.max())
    if table.of == "change":
        return float(x[-1] - x[0]) if x.ndim == 1 else float(away[-1])
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
                f"component {table.component!r} is not in channel {table.channel!r}; {near(table.component, names)}"
            )
        return np.asarray(values[:, names.index(table.component)])
    if table.component >= n:
        raise KeyError(f"component {table.component} is not in channel {table.channel!r}, which has {n} (from 0)")
    return np.asarray(values[:, table.component])


def _of_body(table: MeasureTable, bodies: Mapping[str, Any]) -> float:
    parts = [body for name, body in bodies.items() if name.rpartition(".")[0] == table.body]  # segments
    if table.of == "body_mass" and parts:
        return float(sum(body.mass if hasattr(body, "mass") else body.moments.mass for body in parts))
    if table.body is None or table.body not in bodies:
        raise KeyError(f"body {table.body!r} is not in the run; {near(str(table.body), bodies)}")
    body = bodies[table.body]
    if table.of == "body_mass":
        return float(body.mass if hasattr(body, "mass") else body.moments.mass)
    omega = np.asarray(body.omega)
    if table.mode > len(omega) or not np.isfinite(omega[table.mode - 1]):
        raise ValueError(
            f"mode {table.mode} of body {table.body!r} has no natural frequency; it has "
            f"{int(np.isfinite(omega).sum())} modes that have"
        )
    return float(omega[table.mode - 1] / (2 * math.pi))


def _judge(name: str, table: ExpectTable, run: Record, mean_motion: float | None) -> Verdict:
    unit = measured_unit(table, run)
    answers = {
        key: _in_unit(name, key, getattr(table, key), table.units().get(key), unit)
        for key in ("value", "tolerance", "above", "below")
    }
    found = measured(table, run, mean_motion)
    holds, told = True, []
    if answers["value"] is not None:
        tolerance = (
            answers["tolerance"]
            if table.relative_tolerance is None
            else table.relative_tolerance * abs(answers["value"])
        )
        assert tolerance is not None
        holds &= abs(found - answers["value"]) <= tolerance
        told.append(f"{answers['value']:.10g} +- {tolerance:.3g}")
    if answers["above"] is not None:
        holds &= found > answers["above"]
        told.append(f"above {answers['above']:.10g}")
    if answers["below"] is not None:
        holds &= found < answers["below"]
        told.append(f"below {answers['below']:.10g}")
    return Verdict(name, found, ", ".join(told), bool(holds), unit)


def _in_unit(name: str, key: str, number: float | None, given: str | None, unit: str) -> float | None:
    """The number for a quantity in that unit, angular frequencies in hertz. Raises ValueError on another dimension."""
    if number is None or given is None:
        return number
    if unit == "Hz" and given == to_base("1 rad/s")[1]:
        return number / (2 * math.pi)
    wanted = _base_of(unit)
    if wanted is not None and given != wanted:
        raise ValueError(f"expect.{name}.{key}: found a number in {given or 'no unit'}; the quantity is in {unit}")
    return number


def _base_of(unit: str) -> str | None:
    """Base unit of a channel's unit; None where it is not one (columns of several units)."""
    if unit in ("1", "", "per orbit"):
        return ""
    try:
        return to_base(f"1 {ROOTS.get(unit, unit)}")[1]
    except UnitError:
        return None


ROOTS = {"kg^1/2 m": "kg^0.5 m", "kg^1/2 m/s": "kg^0.5 m/s"}


def _mean_motion(case: Case) -> float | None:
    if case.orbit.kind == "none":
        return None
    return math.sqrt(case.orbit.mu / (case.orbit.perigee_radius / (1.0 - case.orbit.eccentricity)) ** 3)
