"""The Campbell diagram of the [campbell] table of a case."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.advice import warn_of
from femflex.advice.stiffening import StiffeningWatch
from femflex.arrays import Array
from femflex.case import Case, read_case
from femflex.case.campbell import CampbellTable
from femflex.case.diagrams import spin_problems
from femflex.dynamics import compile_system
from femflex.noun.problems import CaseError, Problem
from femflex.studies.campbell.diagram import Campbell, assembled_diagram
from femflex.studies.campbell.matching import Match
from femflex.studies.campbell.sweep import Spin, frame_of, spins

if TYPE_CHECKING:
    from femflex.pipeline.decisions import ResolvedCase


def case_campbell(
    case: Case | str | Path, at: float | None = None, progress: Callable[[float], None] | None = None
) -> Campbell:
    """The diagram of a case with a [campbell]. Raises CaseError and as `campbell` does."""
    case = case if isinstance(case, Case) else read_case(case)
    return diagram_of(case, list(case_spins(case, at, progress)))


def diagram_of(case: Case, matched_spins: list[tuple[Spin, Match | None]], complete: bool = True) -> Campbell:
    """The diagram of the spins of a case: all of them, or those before an interruption."""
    table = table_of(case)
    return assembled_diagram(matched_spins, table.modes, table.orders, case.title, complete)


def resolve_campbell_case(case: Case) -> ResolvedCase:
    """The case with all choices made; the equilibrium of its system is computed again at every speed.

    Doubts about the case become warnings. Raises CaseError with what does not fit together.
    """
    from femflex.pipeline.case_equilibrium import resolve_at_rest

    return resolve_at_rest(case)


def case_spins(
    case: Case,
    at: float | None = None,
    progress: Callable[[float], None] | None = None,
    resolved: ResolvedCase | None = None,
) -> Iterator[tuple[Spin, Match | None]]:
    """The steady spins of a case in turn; `resolved`: the case with its choices, by default of `resolve_campbell_case`.

    Warns (PhysicsWarning) of bodies whose stiffening by the fastest spin is not modelled.
    """
    table, axis = table_of(case), axis_of(case)
    resolved = resolve_campbell_case(case) if resolved is None else resolved
    x = None
    for matched_spin in spins(resolved.system, axis, table.speeds, table.modes, at, progress):
        x = matched_spin[0].x
        yield matched_spin
    if x is not None:
        warn_of_ignored_stiffening(resolved, axis * table.speeds[-1], x)


def warn_of_ignored_stiffening(resolved: ResolvedCase, spin: Array, x: Array) -> None:
    """Warn of bodies with linear strain that a steady spin (3,) [rad/s] would stiffen."""
    model = compile_system(replace(resolved.system, frame=frame_of(spin, float(np.linalg.norm(spin)))))
    guard = StiffeningWatch(model, resolved.body_origins)
    guard.watch(np.zeros(1), x[None], model.observe(np.zeros(1), x[None]))
    warn_of(guard.doubts())


def table_of(case: Case) -> CampbellTable:
    """The case's [campbell]. Raises CaseError without one."""
    if case.campbell is None:
        text = "the case has none; give one with speeds = '0:400 rpm:17', or --speeds on the command line"
        raise CaseError(case.path.name, [Problem("campbell", text)])
    return case.campbell


def axis_of(case: Case) -> Array:
    """Unit vector (3,) [1] of the spin axis of a case. Raises CaseError if it has none."""
    table = table_of(case)
    if problems := list(spin_problems(table, case.attitude, case.orbit)):
        raise CaseError(case.path.name, problems)
    direction = np.array(table.axis or case.attitude.spin)
    return np.asarray(direction / np.linalg.norm(direction))
