"""A convergence study: one case at several levels, one number from each."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np

from femflex.arrays import Array
from femflex.assembly import build_part
from femflex.assembly.shared import shared_structures
from femflex.case import Case, CaseError
from femflex.case.evaluate import measured_unit, measured_value
from femflex.case.measure import OF_SYSTEM, MeasureTable
from femflex.case.run import StudyTable
from femflex.pipeline import Prepared, prepare
from femflex.pipeline.case_bodies import with_own_strain
from femflex.pipeline.case_equilibrium import case_modes
from femflex.pipeline.guard import MotionGuard
from femflex.studies.derivative_levels import derivative_levels
from femflex.studies.levels import Level, LevelBodies, LevelSet, mesh_levels, mode_levels
from femflex.studies.segment_levels import segment_levels
from femflex.system import Channel, Part
from femflex.warning import PhysicsWarning

Over = Literal["modes", "mesh", "derivatives", "segments"]
Progress = Callable[[float], object]  # called with the fraction of the work done

LEVEL_SETS: dict[str, Callable[[Case, Sequence[int] | None], LevelSet]] = {
    "modes": mode_levels,
    "mesh": mesh_levels,
    "derivatives": derivative_levels,
    "segments": segment_levels,
}
LEVELS = {  # meaning of a level, and the least one
    "modes": ("numbers of modes", 1),
    "mesh": ("numbers of refinements", 0),
    "derivatives": ("numbers of derivative shapes", 0),
    "segments": ("numbers of segments", 1),
}
STEPS = 10.0  # a run's error over its relative tolerance, by experience: errors of many steps add up
EPS = 1e-14  # rounding of any number, relative
EXAMPLE = '[study]\nquantity = { of = "peak", channel = "markers/beam.tip/deflection" }'


@dataclass(frozen=True)
class Point:
    """Result of a level: number of elastic coordinates or dofs, value, rounding error of the value, and unit.

    derivatives: number of coordinates that are derivative shapes; followers: number of dependent shapes; added: number
    of static shapes; problem: reason why a level too coarse for the case has no value (nan).
    """

    level: int
    count: int
    value: float
    noise: float
    unit: str = ""
    problem: str = ""
    derivatives: int = 0
    followers: int = 0
    added: int = 0


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """A run in memory as `measured_value` needs it: the one channel of the quantity, and the bodies."""

    bodies_of: Mapping[str, Any]
    time: Array = field(default_factory=lambda: np.zeros(0))
    values: Array = field(default_factory=lambda: np.zeros(0))
    channel: Channel = field(default_factory=lambda: Channel("1", "nothing"))
    mean_motion: float | None = None
    rtol: float = 0.0  # of the integration

    def __getitem__(self, path: str) -> Array:
        return self.values

    def names(self, path: str) -> tuple[str, ...]:
        """Names of the entries of the channel."""
        return self.channel.names

    def unit(self, path: str) -> str:
        """Unit of the channel."""
        return self.channel.unit

    def bodies(self) -> Mapping[str, Any]:
        """The bodies by name."""
        return self.bodies_of


@dataclass(frozen=True, eq=False)
class Study:
    """A case, the varied property, and its levels; `points` evaluates them."""

    case: Case
    over: Over
    level_set: LevelSet

    @property
    def quantity(self) -> MeasureTable:
        """The quantity of the case's [study]."""
        assert self.case.study is not None
        return self.case.study.quantity

    @cached_property
    def constant(self) -> dict[str, Part]:
        """The bodies that no level varies."""
        return {name: build_part(self.case, name) for name in self.case.bodies if name not in self.level_set.varied}

    def points(self, progress: Progress | None = None) -> Iterator[Point]:
        """A Point for each level, coarse to fine; progress is reported for the whole study.

        The first levels may be too coarse for the case: an initial displacement that so few modes cannot represent, or
        a mode that is not among them. Raises the error of the last level when no level has a value, and
        IntegrationError when the numerics fail. Physics warnings are those of the finest level.
        """
        levels, has_value, size = self.level_set.levels, False, (-1, 0)
        ends = np.cumsum([step.weight for step in levels])
        for step, end in zip(levels, ends, strict=True):
            report = partial(_report_progress, progress, (end - step.weight) / ends[-1], step.weight / ends[-1])
            report(0.0)
            with warnings.catch_warnings():
                if step is not levels[-1]:  # coarse levels are expected to be inaccurate
                    warnings.simplefilter("ignore", PhysicsWarning)
                level_bodies = step.build()
                if (
                    level_bodies.count,
                    level_bodies.added,
                ) == size:  # a close pair was not split, so this level equals the last one
                    continue
                point = self._point(step, level_bodies, report, may_fail=not has_value and step is not levels[-1])
            has_value, size = has_value or not point.problem, (level_bodies.count, level_bodies.added)
            yield point

    def _point(self, step: Level, level_bodies: LevelBodies, progress: Progress, may_fail: bool) -> Point:
        try:
            value, unit, rtol = self.value(level_bodies, progress)
        except ValueError as error:
            if not (may_fail and self._is_coarse(error)):
                raise
            text = str(error).removeprefix(f"{self.case.path.name}: ")
            return Point(step.level, level_bodies.count, math.nan, math.nan, problem=text)
        noise = max(level_bodies.rounding, STEPS * rtol, EPS) * abs(value)
        return Point(
            step.level,
            level_bodies.count,
            value,
            noise,
            unit,
            "",
            level_bodies.derivatives,
            level_bodies.followers,
            level_bodies.added,
        )

    def value(self, level_bodies: LevelBodies, progress: Progress) -> tuple[float, str, float]:
        """The quantity with these bodies, its unit, and the relative tolerance of the integration behind it."""
        if self.quantity.of == OF_SYSTEM:
            all_bodies = self.constant | level_bodies.bodies | level_bodies.other_bodies
            modes = case_modes(self.case, bodies={name: all_bodies[name] for name in self.case.bodies})
            try:
                return modes.frequency(self.quantity.branch or self.quantity.mode), "Hz", 0.0
            except KeyError as error:
                raise ValueError(error.args[0]) from None
        measured_run = self.measured_run(level_bodies, progress)
        return (
            measured_value(self.quantity, measured_run, measured_run.mean_motion),
            measured_unit(self.quantity, measured_run),
            measured_run.rtol,
        )

    def _is_coarse(self, error: ValueError) -> bool:
        """Whether more modes may remove the error."""
        initial = isinstance(error, CaseError) and all(problem.where.endswith(".initial") for problem in error.problems)
        return self.over == "modes" and (initial or self.quantity.of in ("mode_frequency", OF_SYSTEM))

    def measured_run(self, level_bodies: LevelBodies, progress: Progress) -> MeasuredRun:
        """The run of the case with these bodies, or only the bodies if the quantity needs no run."""
        path = self.quantity.channel
        if path is None:
            return MeasuredRun(level_bodies.bodies)
        all_bodies = self.constant | level_bodies.bodies | level_bodies.other_bodies
        bodies = {name: all_bodies[name] for name in self.case.bodies}
        prepared = prepare(self.case, bodies=bodies)
        motion = None if prepared.system.orbit is None else prepared.system.orbit.mean_motion
        rtol = float(getattr(prepared.integrator, "rtol", 0.0))
        values, channel = channel_of_run(prepared, path, progress), prepared.model.channels[path]
        return MeasuredRun(bodies, prepared.times, values, channel, motion, rtol)


def _report_progress(progress: Progress | None, start: float, share: float, fraction: float) -> None:
    if progress is not None:
        progress(start + share * fraction)


def plan_study(case: Case, over: Over = "modes", levels: Sequence[int] | None = None) -> Study:
    """The study of a case's [study] quantity over its modes, its meshes or its derivative shapes.

    levels: numbers of modes (from 1) or refinements (from 0); by default those of the case, or usual ones.
    Raises ValueError when the case has no [study], nothing to vary, or the levels are too few or invalid.
    """
    require_valid_property(over)
    require_study(case)
    meaning, least = LEVELS[over]
    if levels is not None and (len(set(levels)) < 2 or min(levels) < least):
        found_text, meaning = ", ".join(map(str, levels)) or "none", f"{meaning}, each at least {least}"
        raise ValueError(f"found levels {found_text}; give at least two different {meaning} (an order needs three).")
    with shared_structures():
        case_with_strain = with_own_strain(case)
        level_set = (
            mode_levels(case_with_strain, levels, case)
            if over == "modes"
            else LEVEL_SETS[over](case_with_strain, levels)
        )
        return Study(case_with_strain, over, level_set)


def require_valid_property(over: str) -> None:
    """Raise ValueError for a word that names no property of a study."""
    if over not in LEVEL_SETS:
        raise ValueError(f"a study varies {', '.join(LEVEL_SETS)}, functions or strain; found {over!r}.")


def require_study(case: Case) -> StudyTable:
    """The [study] of a case. Raises ValueError when it has none."""
    if case.study is None:
        raise ValueError(
            f"{case.path.name} has no [study] to say which quantity is watched; add one, such as\n{EXAMPLE}"
        )
    return case.study


def channel_of_run(prepared: Prepared, path: str, progress: Progress) -> Array:
    """One channel of a run without a file, (n_t, ...), in its unit."""
    model, times = prepared.model, prepared.times
    rows, guard = [], MotionGuard(model)
    for block in prepared.integrator.blocks(model, times, model.x0):
        if (error := guard.divergence(block)) is not None:
            raise error
        if len(block.times):
            rows.append(model.observation(block.times, block.states)[path])
        progress((block.t - times[0]) / (times[-1] - times[0]))
    return np.concatenate(rows)


def quantity_text(quantity: MeasureTable) -> str:
    """A quantity in words: "peak of attitude/angles pitch", "frequency of mode 1 of beam"."""
    q = quantity
    if q.of == "mode_frequency":
        return f"frequency of mode {q.mode} of {q.body}"
    if q.of == "body_mass":
        return f"mass of {q.body}"
    if q.of == OF_SYSTEM:
        return f"frequency of {q.branch or f'mode {q.mode}'} of the craft"
    measure_text = f"frequency {q.tone} of {q.tones}" if q.of == "frequency" and q.tones > 1 else q.of
    component = "" if q.component is None else f" {q.component}"
    time_text = f" at {q.at:g} s" if q.at is not None else " at the end" if q.of == "value" else ""
    return f"{measure_text} of {q.channel}{component}{time_text}"
