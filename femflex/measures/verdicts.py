"""Verdicts on what the case expects of its run, its Campbell diagram and its craft's modes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from femflex.measures.evaluate import Record, measured_unit, measured_value
from femflex.measures.measure import OF_CAMPBELL, OF_JITTER, OF_SYSTEM, ExpectationsTable, ExpectTable
from femflex.noun.units import UnitError, to_base
from femflex.system.orbit import Orbit


class Expecting(Protocol):
    """Interface of a case: its expectations and its orbit."""

    @property
    def expect(self) -> ExpectationsTable:
        """Its own answers."""

    @property
    def orbit(self) -> Orbit:
        """Its orbit, of kind "none" where it has none."""


class Diagram(Protocol):
    """Interface of a Campbell diagram (femflex.studies.campbell.Campbell)."""

    def frequency(self, branch: str, speed: float) -> float:
        """Frequency [Hz] of a branch at a speed [rad/s]."""


class Modes(Protocol):
    """Interface of the modes of the craft (femflex.linear.system_modes.SystemModes)."""

    def frequency(self, mode: int | str) -> float:
        """Frequency [Hz] of a mode by its number or name."""


@dataclass(frozen=True)
class Verdict:
    """An expectation, what was measured, and whether it holds; value: the expected number, None for limits."""

    name: str
    measured: float
    expected: str
    holds: bool
    unit: str
    value: float | None = None

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        return (
            f"{self.name}: {self.measured:.10g}{unit}, expected {self.expected}: "
            f"{'holds' if self.holds else 'does not hold'}"
        )


def run_verdicts(case: Expecting, run: Record) -> list[Verdict]:
    """The verdict on every entry of the case's [expect] table that is about a run.

    Raises ValueError or KeyError for a quantity the run does not have.
    """
    motion = None if case.orbit.kind == "none" else case.orbit.mean_motion
    return [
        verdict_on(name, table, measured_value(table, run, motion), measured_unit(table, run))
        for name, table in case.expect.answers.items()
        if table.of not in (OF_CAMPBELL, OF_SYSTEM, OF_JITTER)
    ]


def expects_modes(case: Expecting) -> bool:
    """Whether the case expects anything of the modes of the craft."""
    return any(table.of == OF_SYSTEM for table in case.expect.answers.values())


def mode_verdicts(case: Expecting, modes: Modes) -> list[Verdict]:
    """The verdict on every entry of the case's [expect] table that is about the modes of the craft.

    Raises KeyError for a mode that the craft does not have.
    """
    return [
        verdict_on(name, table, modes.frequency(table.branch or table.mode), "Hz")
        for name, table in case.expect.answers.items()
        if table.of == OF_SYSTEM
    ]


def jitter_verdicts(case: Expecting, rms: Mapping[str, tuple[float, str]]) -> list[Verdict]:
    """The verdict on every entry of the case's [expect] table that is about jitter.

    rms: name of an output -> root mean square and unit. Raises KeyError for an output that [jitter] does not have.
    """
    out = []
    for name, table in case.expect.answers.items():
        if table.of == OF_JITTER:
            if table.output is None or table.output not in rms:
                raise KeyError(f"expect.{name}: [jitter] has no output {table.output!r}; known are {', '.join(rms)}")
            out.append(verdict_on(name, table, *rms[table.output]))
    return out


def diagram_verdicts(case: Expecting, diagram: Diagram) -> list[Verdict]:
    """The verdict on every entry of the case's [expect] table that is about its Campbell diagram.

    Raises KeyError for a branch or a speed that the diagram does not have.
    """
    out = []
    for name, table in case.expect.answers.items():
        if table.of == OF_CAMPBELL:
            assert table.branch is not None and table.speed is not None
            out.append(verdict_on(name, table, diagram.frequency(table.branch, table.speed), "Hz"))
    return out


def verdict_on(name: str, table: ExpectTable, measured: float, unit: str) -> Verdict:
    """The verdict on an entry of the case's [expect] table, for a measured value in its unit."""
    answers = {
        key: _in_unit(name, key, getattr(table, key), table.units().get(key), unit)
        for key in ("value", "tolerance", "above", "below")
    }
    holds, text = True, []
    if answers["value"] is not None:
        tolerance = (
            answers["tolerance"]
            if table.relative_tolerance is None
            else table.relative_tolerance * abs(answers["value"])
        )
        assert tolerance is not None
        holds &= abs(measured - answers["value"]) <= tolerance
        text.append(f"{answers['value']:.10g} +- {tolerance:.3g}")
    if answers["above"] is not None:
        holds &= measured > answers["above"]
        text.append(f"above {answers['above']:.10g}")
    if answers["below"] is not None:
        holds &= measured < answers["below"]
        text.append(f"below {answers['below']:.10g}")
    return Verdict(name, measured, ", ".join(text), bool(holds), unit, answers["value"])


def _in_unit(name: str, key: str, number: float | None, given_unit: str | None, unit: str) -> float | None:
    """The number for a quantity in that unit, angular frequencies in hertz. Raises ValueError on another dimension."""
    if number is None or given_unit is None:
        return number
    if unit == "Hz" and given_unit == to_base("1 rad/s")[1]:
        return number / (2 * math.pi)
    base = _base_of(unit)
    if base is not None and given_unit != base:
        raise ValueError(f"expect.{name}.{key}: found a number in {given_unit or 'no unit'}; the quantity is in {unit}")
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
