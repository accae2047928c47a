"""A convergence study: one case at several levels, one number from each."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal, get_args

import numpy as np

from femflex.arrays import Array
from femflex.assembly import build_part
from femflex.assembly.shared import shared_structures
from femflex.case import Case, CaseError
from femflex.case.run import StudyTable
from femflex.integrate import IntegrationError
from femflex.measures.evaluate import measured_unit, measured_value
from femflex.measures.measure import OF_JITTER, OF_SYSTEM, MeasureTable
from femflex.noun.problems import suggestion_text
from femflex.pipeline import prepare
from femflex.pipeline.case_bodies import with_own_strain
from femflex.pipeline.case_equilibrium import case_modes
from femflex.pipeline.guard import MotionGuard
from femflex.studies.jitter import jitter
from femflex.studies.levels import VARIED, Level, LevelBodies, LevelSet, level_set
from femflex.system import Channel, Part
from femflex.warning import PhysicsWarning


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """Channels of a run in memory, as `measured_value` needs them; none where only bodies are measured.

    mean_motion  of the orbit [rad/s], None without one;  rtol  relative tolerance of the integration
    """

    bodies_by_name: Mapping[str, Any]
    time: Array = field(default_factory=lambda: np.zeros(0))
    values: Mapping[str, Array] = field(default_factory=dict)
    channels: Mapping[str, Channel] = field(default_factory=dict)
    mean_motion: float | None = None
    rtol: float = 0.0

    def __getitem__(self, path: str) -> Array:
        return self.values[path]

    def names(self, path: str) -> tuple[str, ...]:
        """Names of the entries of a channel."""
        return self.channels[path].names

    def unit(self, path: str) -> str:
        """Unit of a channel."""
        return self.channels[path].unit

    def bodies(self) -> Mapping[str, Any]:
        """The bodies by name."""
        return self.bodies_by_name


def recorded_run(
    case: Case,
    bodies: Mapping[str, Part] | None,
    paths: Sequence[str],
    progress: Callable[[float], object] = lambda part: None,
) -> RecordedRun:
    """The run of a case with these bodies (None: its own), with these of its channels.

    Raises KeyError for a channel that the run does not have, IntegrationError where the motion diverges.
    """
    prepared = prepare(case, bodies=bodies)
    model, times = prepared.model, prepared.times
    for path in paths:
        if path not in model.channels:
            raise KeyError(f"the run has no channel {path!r}; {suggestion_text(path, model.channels)}")
    rows: dict[str, list[Array]] = {path: [] for path in paths}
    guard = MotionGuard(model)
    for block in prepared.integrator.blocks(model, times, model.x0):
        if (error := guard.divergence(block)) is not None:
            raise error
        if len(block.times):
            observed = model.observation(block.times, block.states)
            for path in paths:
                rows[path].append(observed[path])
        progress((block.t - times[0]) / (times[-1] - times[0]))
    motion = None if prepared.system.orbit is None else prepared.system.orbit.mean_motion
    values = {path: np.concatenate(parts) for path, parts in rows.items()}
    rtol = float(getattr(prepared.integrator, "rtol", 0.0))
    return RecordedRun(prepared.system.bodies, times, values, model.channels, motion, rtol)


Over = Literal["modes", "mesh", "derivatives", "segments"]
Progress = Callable[[float], object]  # called with the fraction of the work done

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
                if (level_bodies.count, level_bodies.added) == size:  # a close pair was not split: as the level before
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
        counts = level_bodies.derivatives, level_bodies.followers, level_bodies.added
        return Point(step.level, level_bodies.count, value, noise, unit, "", *counts)

    def value(self, level_bodies: LevelBodies, progress: Progress) -> tuple[float, str, float]:
        """The quantity with these bodies, its unit, and the relative tolerance of the integration behind it."""
        if self.quantity.of == OF_JITTER:
            all_bodies = self.constant | level_bodies.bodies | level_bodies.other_bodies
            budget = jitter(self.case, {name: all_bodies[name] for name in self.case.bodies})
            return *budget.rms_of(str(self.quantity.output)), 0.0
        if self.quantity.of == OF_SYSTEM:
            all_bodies = self.constant | level_bodies.bodies | level_bodies.other_bodies
            modes = case_modes(self.case, bodies={name: all_bodies[name] for name in self.case.bodies})
            try:
                return modes.frequency(self.quantity.branch or self.quantity.mode), "Hz", 0.0
            except KeyError as error:
                raise ValueError(error.args[0]) from None
        run = self.recorded_run(level_bodies, progress)
        return measured_value(self.quantity, run, run.mean_motion), measured_unit(self.quantity, run), run.rtol

    def _is_coarse(self, error: ValueError) -> bool:
        """Whether more modes may remove the error."""
        initial = isinstance(error, CaseError) and all(problem.where.endswith(".initial") for problem in error.problems)
        return self.over == "modes" and (initial or self.quantity.of in ("mode_frequency", OF_SYSTEM))

    def recorded_run(self, level_bodies: LevelBodies, progress: Progress) -> RecordedRun:
        """The run of the case with these bodies, or only the bodies if the quantity needs no run."""
        if self.quantity.channel is None:
            return RecordedRun(level_bodies.bodies)
        all_bodies = self.constant | level_bodies.bodies | level_bodies.other_bodies
        bodies = {name: all_bodies[name] for name in self.case.bodies}
        return recorded_run(self.case, bodies, [self.quantity.channel], progress)


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
    varied = VARIED[over]
    if levels is not None and (len(set(levels)) < 2 or min(levels) < varied.least):
        raise ValueError(
            f"found levels {', '.join(map(str, levels)) or 'none'}; give at least two different numbers of "
            f"{varied.noun}s, each at least {varied.least} (an order needs three)."
        )
    with shared_structures():
        case_with_strain = with_own_strain(case)
        return Study(case_with_strain, over, level_set(case_with_strain, over, levels, case))


def require_valid_property(over: str) -> None:
    """Raise ValueError for a word that names no property of a study."""
    if over not in get_args(Over):
        raise ValueError(f"a study varies {', '.join(get_args(Over))}, functions or strain; found {over!r}.")


def require_study(case: Case) -> StudyTable:
    """The [study] of a case. Raises ValueError when it has none."""
    if case.study is None:
        raise ValueError(
            f"{case.path.name} has no [study] to say which quantity is watched; add one, such as\n{EXAMPLE}"
        )
    return case.study


def reason_without_value(case: Case, error: IntegrationError | ValueError) -> str:
    """Reason why the quantity of a case has no value, from the error of its run, without the name of the file."""
    if isinstance(error, IntegrationError):
        return f"it diverges at t = {error.t:.4g} s"
    text = error.problems[0].text if isinstance(error, CaseError) else str(error)
    return text.removeprefix(f"{case.path.name}: ").rstrip(".")


def quantity_text(quantity: MeasureTable) -> str:
    """A quantity in words: "peak of attitude/angles pitch", "frequency of mode 1 of beam"."""
    q = quantity
    if q.of == "mode_frequency":
        return f"frequency of mode {q.mode} of {q.body}"
    if q.of == "body_mass":
        return f"mass of {q.body}"
    if q.of == OF_JITTER:
        return f"jitter (rms) of {q.output}"
    if q.of == OF_SYSTEM:
        return f"frequency of {q.branch or f'mode {q.mode}'} of the craft"
    measure_text = f"frequency {q.tone} of {q.tones}" if q.of == "frequency" and q.tones > 1 else q.of
    component = "" if q.component is None else f" {q.component}"
    time_text = f" at {q.at:g} s" if q.at is not None else " at the end" if q.of == "value" else ""
    return f"{measure_text} of {q.channel}{component}{time_text}"
