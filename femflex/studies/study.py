"""A convergence study: one case over a ladder of levels, one number from each."""

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
from femflex.case.evaluate import measured, measured_unit
from femflex.case.measure import OF_SYSTEM, MeasureTable
from femflex.case.run import StudyTable
from femflex.pipeline import Prepared, prepare
from femflex.pipeline.balanced import case_modes
from femflex.pipeline.case_bodies import with_own_strain
from femflex.pipeline.guard import MotionGuard
from femflex.studies.derivative_ladder import derivative_ladder
from femflex.studies.ladder import Built, Ladder, Rung, mesh_ladder, mode_ladder
from femflex.studies.segment_ladder import segment_ladder
from femflex.system import Channel, Part
from femflex.warning import PhysicsWarning

Over = Literal["modes", "mesh", "derivatives", "segments"]
Progress = Callable[[float], object]  # called with the part of the work done

LADDERS: dict[str, Callable[[Case, Sequence[int] | None], Ladder]] = {
    "modes": mode_ladder,
    "mesh": mesh_ladder,
    "derivatives": derivative_ladder,
    "segments": segment_ladder,
}
LEVELS = {  # what levels are, and the least
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
    """A level with its count of elastic coordinates or dofs, the value there, the value's own rounding, and their unit.

    derivatives says how many of the coordinates are derivative shapes, followers how many follow, added how many are
    static shapes; problem, why a level too coarse for the case has no value (nan).
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
class Seen:
    """What `measured` asks of a run, kept in memory: the one channel of the quantity, and the bodies."""

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
    """A case, what is varied, and the ladder of levels; `points` climbs it."""

    case: Case
    over: Over
    ladder: Ladder

    @property
    def quantity(self) -> MeasureTable:
        """What the case's [study] watches."""
        assert self.case.study is not None
        return self.case.study.quantity

    @cached_property
    def constant(self) -> dict[str, Part]:
        """The bodies that no level varies."""
        return {name: build_part(self.case, name) for name in self.case.bodies if name not in self.ladder.varied}

    def points(self, progress: Progress | None = None) -> Iterator[Point]:
        """A Point for each level, coarse to fine; progress is reported for the whole study.

        The first levels may be too coarse for the case: an initial displacement that so few modes cannot take, a mode
        that is not among them. Raises what made the last of them fail when no level has a value, and IntegrationError
        when the numerics fail. Physics warnings are those of the finest level.
        """
        rungs, found, size = self.ladder.rungs, False, (-1, 0)
        ends = np.cumsum([rung.weight for rung in rungs])
        for rung, end in zip(rungs, ends, strict=True):
            report = partial(_tell, progress, (end - rung.weight) / ends[-1], rung.weight / ends[-1])
            report(0.0)
            with warnings.catch_warnings():
                if rung is not rungs[-1]:  # of coarse levels it is known that they are coarse
                    warnings.simplefilter("ignore", PhysicsWarning)
                built = rung.build()
                if (built.count, built.added) == size:  # a close pair was kept whole, so nothing is new
                    continue
                point = self._point(rung, built, report, may_fail=not found and rung is not rungs[-1])
            found, size = found or not point.problem, (built.count, built.added)
            yield point

    def _point(self, rung: Rung, built: Built, progress: Progress, may_fail: bool) -> Point:
        try:
            value, unit, rtol = self.value(built, progress)
        except ValueError as error:
            if not (may_fail and self._is_coarse(error)):
                raise
            text = str(error).removeprefix(f"{self.case.path.name}: ")
            return Point(rung.level, built.count, math.nan, math.nan, problem=text)
        noise = max(built.rounding, STEPS * rtol, EPS) * abs(value)
        return Point(rung.level, built.count, value, noise, unit, "", built.derivatives, built.followers, built.added)

    def value(self, built: Built, progress: Progress) -> tuple[float, str, float]:
        """The quantity with these bodies, its unit, and the relative tolerance of the integration behind it."""
        if self.quantity.of == OF_SYSTEM:
            everything = self.constant | built.bodies | built.others
            modes = case_modes(self.case, bodies={name: everything[name] for name in self.case.bodies})
            try:
                return modes.frequency(self.quantity.branch or self.quantity.mode), "Hz", 0.0
            except KeyError as error:
                raise ValueError(error.args[0]) from None
        seen = self.seen(built, progress)
        return measured(self.quantity, seen, seen.mean_motion), measured_unit(self.quantity, seen), seen.rtol

    def _is_coarse(self, error: ValueError) -> bool:
        """Whether the trouble is one that more modes may end."""
        initial = isinstance(error, CaseError) and all(problem.where.endswith(".initial") for problem in error.problems)
        return self.over == "modes" and (initial or self.quantity.of in ("mode_frequency", OF_SYSTEM))

    def seen(self, built: Built, progress: Progress) -> Seen:
        """The run of the case with these bodies, or the bodies alone where that is all the quantity needs."""
        path = self.quantity.channel
        if path is None:
            return Seen(built.bodies)
        everything = self.constant | built.bodies | built.others
        bodies = {name: everything[name] for name in self.case.bodies}
        prepared = prepare(self.case, bodies=bodies)
        motion = None if prepared.system.orbit is None else prepared.system.orbit.mean_motion
        rtol = float(getattr(prepared.integrator, "rtol", 0.0))
        values, channel = watched(prepared, path, progress), prepared.model.channels[path]
        return Seen(bodies, prepared.times, values, channel, motion, rtol)


def _tell(progress: Progress | None, start: float, share: float, part: float) -> None:
    if progress is not None:
        progress(start + share * part)


def planned(case: Case, over: Over = "modes", levels: Sequence[int] | None = None) -> Study:
    """The study of a case's [study] quantity over its modes, its meshes or its derivative shapes.

    levels: numbers of modes (from 1) or refinements (from 0) to try; left out, those of the case, or a usual ladder.
    Raises ValueError when the case has no [study], nothing to vary, or the levels make no ladder.
    """
    require_known(over)
    require_study(case)
    what, least = LEVELS[over]
    if levels is not None and (len(set(levels)) < 2 or min(levels) < least):
        found, what = ", ".join(map(str, levels)) or "none", f"{what}, each at least {least}"
        raise ValueError(f"found levels {found}; give at least two different {what} (an order needs three).")
    with shared_structures():
        own = with_own_strain(case)
        ladder = mode_ladder(own, levels, case) if over == "modes" else LADDERS[over](own, levels)
        return Study(own, over, ladder)


def require_known(over: str) -> None:
    """Raise ValueError for a word that no ladder goes by."""
    if over not in LADDERS:
        raise ValueError(f"a study varies {', '.join(LADDERS)}, functions or strain; found {over!r}.")


def require_study(case: Case) -> StudyTable:
    """The [study] of a case. Raises ValueError when it has none."""
    if case.study is None:
        raise ValueError(
            f"{case.path.name} has no [study] to say which quantity is watched; add one, such as\n{EXAMPLE}"
        )
    return case.study


def watched(prepared: Prepared, path: str, progress: Progress) -> Array:
    """One channel of a run that leaves no file, (n_t, ...), in its unit."""
    model, times = prepared.model, prepared.times
    rows, guard = [], MotionGuard(model)
    for block in prepared.integrator.blocks(model, times, model.x0):
        if (error := guard.divergence(block)) is not None:
            raise error
        if len(block.times):
            rows.append(model.observe(block.times, block.states)[path])
        progress((block.t - times[0]) / (times[-1] - times[0]))
    return np.concatenate(rows)


def described(quantity: MeasureTable) -> str:
    """A quantity in words: "peak of attitude/angles pitch", "frequency of mode 1 of beam"."""
    q = quantity
    if q.of == "mode_frequency":
        return f"frequency of mode {q.mode} of {q.body}"
    if q.of == "body_mass":
        return f"mass of {q.body}"
    if q.of == OF_SYSTEM:
        return f"frequency of {q.branch or f'mode {q.mode}'} of the craft"
    of = f"frequency {q.tone} of {q.tones}" if q.of == "frequency" and q.tones > 1 else q.of
    component = "" if q.component is None else f" {q.component}"
    when = f" at {q.at:g} s" if q.at is not None else " at the end" if q.of == "value" else ""
    return f"{of} of {q.channel}{component}{when}"
