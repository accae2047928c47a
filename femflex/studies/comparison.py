"""Comparison of forms of strain, and of types of functions over their number; and several studies in turn.

Each option of a case is assessed against one that is trusted most: of forms of strain the one that holds for the
largest deflections, of types of functions the one that changes least with their number.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.assembly import build_part
from femflex.case import Case
from femflex.case.body import AnalyticTable, BodyTable, Strain
from femflex.case.deploying import DeployingTable
from femflex.integrate import IntegrationError
from femflex.pipeline.case_bodies import with_own_strain
from femflex.studies.convergence import Convergence
from femflex.studies.levels import LevelBodies, LevelSet, varied_names, with_level
from femflex.studies.study import (
    Point,
    Progress,
    Study,
    plan_study,
    quantity_text,
    reason_without_value,
    require_study,
    require_valid_property,
)
from femflex.warning import PhysicsWarning

FORMS: tuple[Strain, ...] = ("linear", "condensed", "nonlinear")  # each holds for larger deflections than the last
PLAIN: dict[str, Any] = {"static": False, "tip": False, "joints": []}
KINDS: dict[str, dict[str, Any]] = {  # type of functions -> changes in a body's table of functions
    "characteristic": {"family": "characteristic", **PLAIN},
    "characteristic, static": {"family": "characteristic", **PLAIN, "static": True},
    "characteristic, tip": {"family": "characteristic", **PLAIN, "tip": True},
    "polynomial": {"family": "polynomial", **PLAIN},
    "elements": {"family": "elements", **PLAIN, "elements": None, "straight": True},
}
LEAST = {"characteristic, static": 2, "characteristic, tip": 2}  # functions of a field
LEVELS = (1, 2, 3, 4, 6, 8)  # default numbers of functions of a field


@dataclass(frozen=True, eq=False)
class Option:
    """A form of strain or a type of functions in all bodies that can take it.

    points   its values, over the number of functions of a field; one for a form of strain, none without a value
    problem  reason for no value;  seconds  time of the runs
    """

    name: str
    points: tuple[Point, ...]
    problem: str = ""
    seconds: float = math.nan

    @property
    def values(self) -> Array:
        """Values of the quantity (k,)."""
        return np.array([point.value for point in self.points])

    @property
    def counts(self) -> IntArray:
        """Numbers of elastic coordinates (k,)."""
        return np.array([point.count for point in self.points], np.int64)


@dataclass(frozen=True, eq=False)
class Comparison:
    """The options of a study over "strain" or "functions", and in words what the bodies have in the case (`own`)."""

    over: str
    title: str
    tolerance: float
    options: tuple[Option, ...]
    own: Mapping[str, str]

    @property
    def with_values(self) -> list[Option]:
        """Options with values."""
        return [option for option in self.options if option.points]

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return next((option.points[-1].unit for option in self.with_values), "")

    @property
    def reference(self) -> Option | None:
        """The option that is trusted most."""
        if self.over == "strain":
            return next(reversed(self.with_values), None)
        several = [option for option in self.with_values if len(option.points) > 1]
        return min(several, key=lambda option: abs(np.diff(option.values)[-1]), default=None)

    def differences(self, option: Option) -> Array:
        """Relative differences of the values (k,) from the last one of the reference; nan without a reference."""
        if self.reference is None:
            return np.full(len(option.points), math.nan)
        best = float(self.reference.values[-1])
        return np.asarray(np.abs(option.values - best) / (abs(best) or 1.0))

    def enough(self, option: Option) -> Point | None:
        """The first point from which on all values are within the tolerance."""
        unacceptable = np.flatnonzero(~(self.differences(option) <= self.tolerance))
        start = int(unacceptable[-1]) + 1 if unacceptable.size else 0
        return option.points[start] if start < len(option.points) else None

    @property
    def is_settled(self) -> bool:
        """Whether the reference is trusted: its last change, or another's last value, is within the tolerance."""
        best = self.reference
        others = [option for option in self.with_values if option is not best]
        if best is None or self.over == "strain":
            return bool(others)
        change = abs(np.diff(best.values)[-1]) <= self.tolerance * (abs(best.values[-1]) or 1.0)
        return bool(change or any(self.differences(option)[-1] <= self.tolerance for option in others))

    @property
    def choice(self) -> tuple[str, int] | None:
        """The simplest form of strain, or the type and number of functions with the fewest coordinates, that suffices.

        None where nothing can be compared, or no type settles.
        """
        points = [(option.name, point) for option in self.with_values if (point := self.enough(option)) is not None]
        if not self.is_settled or not points:
            return None
        fewest = 0 if self.over == "strain" else int(np.argmin([point.count for _, point in points]))
        return points[fewest][0], points[fewest][1].level

    @property
    def recommended(self) -> str | None:
        """The choice in words, such as "condensed", or "polynomial, 4"."""
        if self.choice is None or self.over == "strain":
            return None if self.choice is None else self.choice[0]
        return f"{self.choice[0]}, {self.choice[1]}"

    @cached_property
    def verdict(self) -> str:
        """The conclusions, in sentences."""
        best, noun = self.reference, "strain has" if self.over == "strain" else "functions have"
        sentences = [
            f"{option.name.capitalize()} {noun} no value: {option.problem}."
            for option in self.options
            if not option.points
        ]
        if best is None or (self.over == "strain" and not self.is_settled):
            return " ".join([*sentences, "Nothing can be compared."])
        for option in self.with_values:
            if self.over == "strain" and option is best:
                continue
            point = self.enough(option) or option.points[-1]
            off = self.differences(option)[option.points.index(point)]
            number = f" with {point.level} per field" if self.over == "functions" else ""
            cost = f", in {option.seconds / best.seconds:.2g} of its time" if self.over == "strain" else ""
            verb = "suffices" if self.enough(option) is not None else "does not suffice"
            sentences.append(f"{option.name.capitalize()}{number} {verb} ({off:.2g} off{cost}).")
        number = f" with {best.points[-1].level} per field" if self.over == "functions" else ""
        sentences.append(f"Differences are from {best.name}{number}, relative (tolerance {self.tolerance:g}).")
        chosen = f"Choose {self.recommended}." if self.choice else "No type settles; try more functions."
        return " ".join([*sentences, chosen])


def strain_forms(case: Case, tolerance: float | None = None, progress: Progress | None = None) -> Comparison:
    """The Comparison of a case's [study] quantity; every body with a choice of strain takes all three forms in turn.

    Raises ValueError when the case has no [study] or no such body.
    """
    table, case = require_study(case), with_own_strain(case)
    names = varied_names(case, "strain")
    options = []
    for k, strain in enumerate(FORMS):
        if progress is not None:
            progress(k / len(FORMS))
        changed = with_level(case, names, "strain", strain)
        study = Study(changed, "modes", LevelSet(tuple(names), (), None))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # large deflections with linear strain are intended here
            try:
                bodies = LevelBodies({name: build_part(changed, name) for name in names}, 0)
                _ = study.constant
                start = time.perf_counter()
                value, unit, _ = study.value(bodies, lambda part: None)
            except (IntegrationError, ValueError) as error:
                options.append(Option(strain, (), reason_without_value(case, error)))
                continue
        count = sum(body.n_modes for body in bodies.parts)
        point = Point(1, count, value, 0.0, unit, "", bodies.derivatives, bodies.followers)
        options.append(Option(strain, (point,), "", time.perf_counter() - start))
    own = {name: case.bodies[name].strain or "not set" for name in names}  # type: ignore[union-attr]
    return Comparison("strain", quantity_text(table.quantity), tolerance or table.tolerance, tuple(options), own)


def function_kinds(
    case: Case,
    levels: Sequence[int] | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """The Comparison of a case's [study] quantity; all bodies with functions use each type in turn.

    levels: numbers of functions of a field; left out, those of the case, or 1 to 8.

    Raises ValueError when the case has no [study] or no body with functions.
    """
    table, names = require_study(case), varied_names(case, "functions")
    counts = sorted(set(levels or table.modes or LEVELS))
    kinds = [kind for kind in KINDS if all(kind in _kind_updates(case.bodies[name]) for name in names)]
    options = []
    for k, kind in enumerate(kinds):
        tell = None if progress is None else (lambda x, k=k: progress((k + x) / len(kinds)))
        usable, start = [n for n in counts if n >= LEAST.get(kind, 1)], time.perf_counter()
        points, problem = list[Point](), f"at least two numbers from {LEAST.get(kind, 1)} on are needed"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # coarse levels are expected to be inaccurate
            try:
                if len(usable) > 1:
                    points += plan_study(with_function_kind(case, names, kind), "modes", usable).points(tell)
            except (IntegrationError, ValueError) as error:
                points, problem = [], reason_without_value(case, error)
        valued = tuple(point for point in points if not point.problem)
        options.append(Option(kind, valued, "" if valued else problem, time.perf_counter() - start))
    own = {name: _case_kind_text(case.bodies[name]) for name in names}
    return Comparison("functions", quantity_text(table.quantity), tolerance or table.tolerance, tuple(options), own)


def _kind_updates(table: BodyTable) -> dict[str, dict[str, Any]]:
    """Type -> changes in the table of a body's functions."""
    assert isinstance(table, AnalyticTable | DeployingTable) and table.functions is not None
    possible = {"characteristic", "polynomial"}
    if isinstance(table, AnalyticTable):
        possible |= {"characteristic, static"} if table.functions.ends == "clamped-free" else set()
    else:
        possible |= set(KINDS) - {"elements"} if table.family == "beam" else set()
        possible |= {"elements"} if table.family in ("beam", "plate") or table.tension else set()
    declared = type(table.functions).model_fields
    return {kind: {key: KINDS[kind][key] for key in KINDS[kind] if key in declared} for kind in possible}


def with_function_kind(case: Case, names: Sequence[str], kind: str, level: int | None = None) -> Case:
    """The case with that type of functions in these bodies, and `level` of them a field where it is given."""
    bodies: dict[str, Any] = dict(case.bodies)
    for name in names:
        functions = bodies[name].functions.model_copy(update=_kind_updates(bodies[name])[kind])
        bodies[name] = bodies[name].model_copy(update={"functions": functions})
    changed = case.model_copy(update={"bodies": bodies})
    return changed if level is None else with_level(changed, names, "functions", level)


def _case_kind_text(table: BodyTable) -> str:
    """Type and numbers of the functions of a body in the case."""
    f: Any = table.functions  # type: ignore[attr-defined]
    added = "".join(f", {key}" for key in ("static", "tip") if getattr(f, key, False))
    count = max(f.y, f.z, getattr(f, "axial", 0), getattr(f, "torsion", 0))
    return f"{f.family or 'by default'}{added}, {count}"


# several studies in turn

Finding = Convergence | Comparison


def check_studies(case: Case, varied: Sequence[str]) -> None:
    """Raise ValueError when a study in the list is not known, has nothing to vary, or comes too early.

    case: with the strain of its bodies filled in (`pipeline.case_bodies.with_own_strain`).
    """
    require_study(case)
    for word in varied:
        if word not in ("strain", "functions"):
            require_valid_property(word)
        varied_names(case, word)
    if "strain" in varied and "derivatives" in varied[list(varied).index("strain") :]:
        reordered = [word for word in varied if word != "strain"] + ["strain"]
        raise ValueError(
            f"found --over {','.join(varied)}: derivatives can be varied only if the study over strain selects a form "
            f"that has them; give --over {','.join(reordered)}"
        )


def recommended_level(study: Finding) -> int | str | None:
    """The level to continue with: the recommended one, or else the finest; None if nothing could be compared."""
    if study.recommended is not None or isinstance(study, Comparison):
        return study.recommended
    return int(study.levels[study.n_resolved - 1])


def with_recommended_level(case: Case, study: Finding, names: Sequence[str]) -> Case:
    """The case with the recommendation of a study over these bodies."""
    level = recommended_level(study)
    if level is None:
        return case
    if isinstance(study, Comparison) and study.over == "functions":
        assert study.choice is not None
        return with_function_kind(case, names, *study.choice)
    return with_level(case, names, study.over, level)


def recommendation_text(findings: Sequence[Finding]) -> str:
    """All choices in one sentence, and the studies that did not reach the tolerance."""
    choices = [
        f"{study.over} = {recommended_level(study)!r}" for study in findings if recommended_level(study) is not None
    ]
    unreached = [study.over for study in findings if study.recommended is None]
    if not choices:
        return "No study gave a result to choose by."
    text = f"Choose {', '.join(choices)}: each study used the results of the ones before it."
    return text + (f" Over {', '.join(unreached)} the tolerance is not reached." if unreached else "")
