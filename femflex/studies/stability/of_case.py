"""The locus or chart of the [stability] table of a case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femflex.case import Case
from femflex.case.campbell import RATIOS, AxisTable, StabilityTable
from femflex.dynamics import compile_system
from femflex.noun.problems import CaseError, Problem
from femflex.studies.stability.chart import Chart, stability_chart
from femflex.studies.stability.inertia_ratios import affine_judge, present_ratios, with_ratios
from femflex.studies.stability.judgement import Judgement, equilibrium_stability, motion_stability, no_judgement
from femflex.studies.stability.locus import Locus, stability_locus
from femflex.studies.varied_case import VariedCase
from femflex.system import System

Progress = Callable[[float], object]


@dataclass(frozen=True, eq=False)
class CaseStability:
    """The locus or chart of a case, and a second one with terms omitted."""

    result: Locus | Chart
    second: Locus | Chart | None
    left_out: tuple[str, ...]
    table: StabilityTable

    @property
    def ratios(self) -> bool:
        """Whether the chart is over the inertia ratios."""
        return self.table.inertia is not None


def case_stability(case: Case, progress: Progress | None = None) -> CaseStability:
    """The stability of a case over the values of its [stability].

    progress is called with the part that is done, from 0 to 1. Raises CaseError without the table and for a key path
    that is not in the case; a point that the case does not take, or without equilibrium, has no result.
    """
    table = table_of(case)
    judges = [_Judge.from_case(case, table, ())]
    if table.without:
        judges.append(_Judge.from_case(case, table, tuple(table.without)))
    results: list[Locus | Chart] = []
    for k, judge in enumerate(judges):
        tell = None if progress is None else _partial_progress(progress, k, len(judges), table)
        results.append(judge.evaluate(table, tell))
    return CaseStability(results[0], results[1] if len(results) > 1 else None, tuple(table.without), table)


def table_of(case: Case) -> StabilityTable:
    """The case's [stability]. Raises CaseError without one, and for key paths that are not in the case."""
    if case.stability is None:
        text = "the case has none; give one with vary, or --vary KEY=FIRST:LAST:NUMBER on the command line"
        raise CaseError(case.path.name, [Problem("stability", text)])
    if case.stability.inertia is None:
        from femflex.case.changed import changed_text

        values = {key: _value_with_unit(axis, axis.numbers()[0]) for key, axis in case.stability.vary.items()}
        try:
            changed_text(case.text, values, case.path.name)
        except ValueError as error:
            raise CaseError(case.path.name, [Problem("stability.vary", str(error))]) from None
    return case.stability


def _partial_progress(progress: Progress, k: int, count: int, table: StabilityTable) -> Progress:
    points = float(np.prod([axis.points for axis in table.vary.values()]))
    return lambda n_done: progress((k + n_done / points) / count)


def _value_with_unit(axis: AxisTable, value: float) -> float | str:
    unit = axis.numbers()[2]
    return f"{value!r} {unit}" if unit else value


@dataclass(frozen=True, eq=False)
class _Judge:
    """The judgement of a case at values of its keys."""

    varied: VariedCase
    table: StabilityTable
    omitted: tuple[str, ...]
    base: System | None
    affine: Callable[[float, float], Judgement] | None = None

    @classmethod
    def from_case(cls, case: Case, table: StabilityTable, omitted: tuple[str, ...]) -> _Judge:
        """The judgement with bodies built once; for inertia ratios the system too."""
        if table.inertia is None:
            return cls(VariedCase.from_paths(case, table.vary), table, omitted, None)
        varied = VariedCase.from_paths(case, [])
        base = varied.system({})
        with_ratios(base, table.inertia, *present_ratios(base))
        affine = affine_judge(base, table.inertia, omitted) if table.of == "equilibrium" else None
        return cls(varied, table, omitted, base, affine)

    def __call__(self, *values: float) -> Judgement:
        """The judgement at these values, in the order of the keys."""
        if self.affine is not None:
            return self.affine(*(values[list(self.table.vary).index(key)] for key in RATIOS))
        try:
            system = self._system(dict(zip(self.table.vary, values, strict=True)))
        except ValueError as error:
            return no_judgement(" ".join(str(error).split()))
        if self.table.of == "equilibrium":
            return equilibrium_stability(system)
        return motion_stability(system, self._period(system), self.table.shooting)

    def _system(self, values: dict[str, float]) -> System:
        if self.base is not None:
            assert self.table.inertia is not None
            system = with_ratios(self.base, self.table.inertia, *(values[key] for key in RATIOS))
        else:
            written = {key: _value_with_unit(self.table.vary[key], value) for key, value in values.items()}
            system = self.varied.system(written)
        return compile_system(system).without(*self.omitted).system if self.omitted else system

    def _period(self, system: System) -> float:
        if self.table.period is not None:
            return self.table.period
        if system.orbit is not None:
            return system.orbit.period
        rate = float(np.linalg.norm(system.frame.rate)) if system.frame.kind == "spinning" else 0.0
        if not rate:
            raise ValueError("found no period, and neither an orbit nor a spinning frame to take it from; give period")
        return 2 * np.pi / rate

    def evaluate(self, table: StabilityTable, progress: Progress | None) -> Locus | Chart:
        """The locus or chart over the values of the table."""
        names, axes = tuple(table.vary), [axis.numbers() for axis in table.vary.values()]
        points, units = [axis.points for axis in table.vary.values()], [unit for _, _, unit in axes]
        grids = [np.linspace(a, b, n).tolist() for (a, b, _), n in zip(axes, points, strict=True)]
        if len(names) == 1:
            quantity = "poles" if table.of == "equilibrium" else "multipliers"
            return stability_locus(self, grids[0], names[0], units[0], quantity, progress)
        return stability_chart(self, grids[0], grids[1], (names[0], names[1]), (units[0], units[1]), progress)
