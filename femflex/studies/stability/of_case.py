"""The locus or chart of the [stability] table of a case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femflex.case import Case
from femflex.case.problems import CaseError, Problem
from femflex.case.stability import RATIOS, AxisTable, StabilityTable
from femflex.dynamics import compile_system
from femflex.studies.stability.affine import AffineChart
from femflex.studies.stability.chart import Chart, stability_chart
from femflex.studies.stability.gravity_gradient import with_ratios
from femflex.studies.stability.judgement import Judgement, judged_motion, judged_rest, none
from femflex.studies.stability.locus import Locus, stability_locus
from femflex.studies.varied import VariedCase
from femflex.system import System

Progress = Callable[[float], object]


@dataclass(frozen=True, eq=False)
class CaseStability:
    """The locus or chart of a case, and a second one with something left out."""

    found: Locus | Chart
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
    that is not in the case; a point that the case does not take, or without equilibrium, counts as none.
    """
    table = table_of(case)
    judges = [_Judge.of(case, table, ())]
    if table.without:
        judges.append(_Judge.of(case, table, tuple(table.without)))
    found: list[Locus | Chart] = []
    for k, judge in enumerate(judges):
        tell = None if progress is None else _part(progress, k, len(judges), table)
        found.append(judge.found(table, tell))
    return CaseStability(found[0], found[1] if len(found) > 1 else None, tuple(table.without), table)


def table_of(case: Case) -> StabilityTable:
    """The case's [stability]. Raises CaseError without one, and for key paths that are not in the case."""
    if case.stability is None:
        text = "the case has none; give one with vary, or --vary KEY=FIRST:LAST:NUMBER on the command line"
        raise CaseError(case.path.name, [Problem("stability", text)])
    if case.stability.inertia is None:
        from femflex.case.changed import changed_text

        try:
            changed_text(
                case.text,
                {key: _written(one, one.numbers()[0]) for key, one in case.stability.vary.items()},
                case.path.name,
            )
        except ValueError as error:
            raise CaseError(case.path.name, [Problem("stability.vary", str(error))]) from None
    return case.stability


def _part(progress: Progress, k: int, count: int, table: StabilityTable) -> Progress:
    points = float(np.prod([axis.points for axis in table.vary.values()]))
    return lambda done: progress((k + done / points) / count)


def _written(axis: AxisTable, value: float) -> float | str:
    unit = axis.numbers()[2]
    return f"{value!r} {unit}" if unit else value


@dataclass(frozen=True, eq=False)
class _Judge:
    """The judgement of a case at values of its keys."""

    varied: VariedCase
    table: StabilityTable
    without: tuple[str, ...]
    base: System | None
    affine: AffineChart | None = None

    @classmethod
    def of(cls, case: Case, table: StabilityTable, without: tuple[str, ...]) -> _Judge:
        """The bodies built once; for inertia ratios the system too."""
        if table.inertia is None:
            return cls(VariedCase.of(case, table.vary), table, without, None)
        varied = VariedCase.of(case, [])
        base = varied.system({})
        with_ratios(base, table.inertia, *_middle(base))
        affine = AffineChart.of(base, table.inertia, without) if table.of == "equilibrium" else None
        return cls(varied, table, without, base, affine)

    def __call__(self, *values: float) -> Judgement:
        """The judgement at these values, in the order of the keys."""
        if self.affine is not None:
            return self.affine(*(values[list(self.table.vary).index(key)] for key in RATIOS))
        try:
            system = self._system(dict(zip(self.table.vary, values, strict=True)))
        except ValueError as error:
            return none(" ".join(str(error).split()))
        if self.table.of == "equilibrium":
            return judged_rest(system)
        return judged_motion(system, self._period(system), self.table.shooting)

    def _system(self, values: dict[str, float]) -> System:
        if self.base is not None:
            assert self.table.inertia is not None
            system = with_ratios(self.base, self.table.inertia, *(values[key] for key in RATIOS))
        else:
            system = self.varied.system({key: _written(self.table.vary[key], value) for key, value in values.items()})
        return compile_system(system).without(*self.without).system if self.without else system

    def _period(self, system: System) -> float:
        if self.table.period is not None:
            return self.table.period
        if system.orbit is not None:
            return system.orbit.period
        rate = float(np.linalg.norm(system.frame.rate)) if system.frame.kind == "spinning" else 0.0
        if not rate:
            raise ValueError("found no period, and neither an orbit nor a spinning frame to take it from; give period")
        return 2 * np.pi / rate

    def found(self, table: StabilityTable, progress: Progress | None) -> Locus | Chart:
        """The locus or chart."""
        names, axes = tuple(table.vary), [axis.numbers() for axis in table.vary.values()]
        grids = [np.linspace(a, b, one.points) for (a, b, _), one in zip(axes, table.vary.values(), strict=True)]
        if len(names) == 1:
            of = "poles" if table.of == "equilibrium" else "multipliers"
            return stability_locus(self, grids[0].tolist(), names[0], axes[0][2], of, progress)
        return stability_chart(
            self, grids[0].tolist(), grids[1].tolist(), (names[0], names[1]), (axes[0][2], axes[1][2]), progress
        )


def _middle(system: System) -> tuple[float, float]:
    """The ratios that the craft has now."""
    from femflex.studies.stability.gravity_gradient import craft_inertia

    pitch, yaw, roll = np.diag(craft_inertia(system)[0])
    return float((pitch - yaw) / roll), float((pitch - roll) / yaw)
