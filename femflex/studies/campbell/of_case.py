"""The Campbell diagram of the [campbell] table of a case, and the diagram over any other value of a case."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.advice.advice import warn_of
from femflex.advice.stiffening import StiffeningWatch
from femflex.arrays import Array
from femflex.case import Case, read_case
from femflex.case.campbell import CampbellTable
from femflex.case.crosscheck import spin_problems
from femflex.dynamics import compile_system
from femflex.linear.character import motion_character
from femflex.linear.equilibrium import EquilibriumError, rest_equilibrium
from femflex.noun.problems import CaseError, Problem
from femflex.pipeline.case_equilibrium import resolve_at_rest
from femflex.studies.campbell.diagram import Campbell, assembled_diagram, frame_of, spin_steps
from femflex.studies.tracking import Step, tracked_steps
from femflex.studies.varied_case import VariedCase

if TYPE_CHECKING:
    from femflex.pipeline.decisions import ResolvedCase

MODES = 6  # default number of tracked branches


def case_campbell(
    case: Case | str | Path, at: float | None = None, progress: Callable[[float], None] | None = None
) -> Campbell:
    """The diagram of a case with a [campbell]. Raises CaseError and as `campbell` does."""
    case = case if isinstance(case, Case) else read_case(case)
    return diagram_of(case, list(case_steps(case, at, progress)))


def diagram_of(case: Case, steps: Sequence[Step], complete: bool = True) -> Campbell:
    """The diagram of the spins of a case: all of them, or those before an interruption."""
    table = table_of(case)
    return assembled_diagram(steps, table.modes, table.orders, case.title, complete)


def case_steps(
    case: Case,
    at: float | None = None,
    progress: Callable[[float], None] | None = None,
    resolved: ResolvedCase | None = None,
) -> Iterator[Step]:
    """The steady spins of a case in turn; `resolved`: the case with its choices, by default of `resolve_at_rest`.

    Warns (PhysicsWarning) of bodies with linear strain whose stiffening by the fastest spin is not modelled.
    """
    table, axis = table_of(case), axis_of(case)
    resolved = resolve_at_rest(case) if resolved is None else resolved
    step: Step | None = None
    for step in spin_steps(resolved.system, axis, table.speeds, table.modes, at, progress):
        yield step
    if step is not None:
        model = compile_system(replace(resolved.system, frame=frame_of(axis, table.speeds[-1])))
        watch, states = StiffeningWatch(model, resolved.body_origins), step.x[None]
        watch.watch(np.zeros(1), states, model.observe(np.zeros(1), states))
        warn_of(watch.doubts())


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


def value_diagram(
    case: Case,
    path: str,
    values: Sequence[float],
    unit: str = "",
    *,
    modes: int = MODES,
    progress: Callable[[float], None] | None = None,
) -> Campbell:
    """The diagram of frequencies of the equilibrium over rising values at a key path, such as "joints.0.stiffness".

    unit: of the values, as a case writes it; modes: every branch that is among this many lowest ones at some value
    is tracked. Raises CaseError for a path or a value that the case does not take, ValueError for values that do not
    rise or change the number of coordinates, EquilibriumError with the value at which there is no equilibrium.
    """
    steps = list(value_steps(case, path, values, unit, modes, progress))
    return assembled_diagram(steps, modes, (), case.title, value=path, unit=unit)


def value_steps(
    case: Case,
    path: str,
    values: Sequence[float],
    unit: str = "",
    modes: int = MODES,
    progress: Callable[[float], None] | None = None,
) -> Iterator[Step]:
    """The small motions at every value in turn, linked with those before."""
    if len(values) < 2 or not (np.diff(values) > 0).all():
        raise ValueError(f"the values of {path} are to rise; found {list(values[:6])}")
    varied = VariedCase.from_paths(case, [path])
    first: tuple[int, int] | None = None  # numbers of loads and of degrees of freedom

    def step_at(value: float, state: Array | None, requested: bool) -> Step:
        nonlocal first
        place = f"{path} = {value:.6g} {unit}".rstrip()
        system = varied.system({path: f"{float(value)!r} {unit}" if unit else float(value)})
        try:
            about = rest_equilibrium(system)[0]
        except EquilibriumError as error:
            raise EquilibriumError(f"at {place} {error}", error.last) from None
        loads, count = len(about.moving.loads), about.model.n_u
        first = first or (loads, count)
        if loads != first[0]:
            sides = ("at", "below") if loads < first[0] else ("below", "at")
            raise EquilibriumError(
                f"{sides[0]} {place} no equilibrium was found under the loads that act {sides[1]} it; let the values "
                "stay on one side of it",
                about,
            )
        if count != first[1]:
            raise ValueError(
                f"the craft has {count} degrees of freedom at {path} = {value:g} and {first[1]} before; branches "
                "need a value that changes none of them"
            )
        motions, frame = about.motions.of_craft(), about.model.system.frame
        axis = frame.rate if frame.kind == "spinning" and np.any(frame.rate) else None
        return Step(value, requested, about.x, motions, motion_character(about.model, motions, axis).words)

    yield from tracked_steps(step_at, list(map(float, values)), modes, progress)
