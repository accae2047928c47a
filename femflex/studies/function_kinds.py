"""Comparison of types of admissible functions: the type and the number that a quantity needs."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from femflex.case import Case
from femflex.case.body import AnalyticTable, BodyTable
from femflex.case.deploying import DeployingTable
from femflex.integrate import IntegrationError
from femflex.studies.convergence import Convergence, assess_convergence
from femflex.studies.levels import varied_names, with_level
from femflex.studies.study import Point, Progress, plan_study, quantity_text, reason_without_value, require_study
from femflex.warning import PhysicsWarning

PLAIN: dict[str, Any] = {"static": False, "tip": False, "joints": []}
CHARACTERISTIC: dict[str, dict[str, Any]] = {
    "characteristic": {"family": "characteristic", **PLAIN},
    "characteristic, static": {"family": "characteristic", **PLAIN, "static": True},
    "characteristic, tip": {"family": "characteristic", **PLAIN, "tip": True},
}
POLYNOMIAL: dict[str, Any] = {"family": "polynomial", **PLAIN}
ELEMENTS: dict[str, Any] = {"family": "elements", **PLAIN, "elements": None, "straight": True}
LEAST = {"characteristic, static": 2, "characteristic, tip": 2}  # functions of a field
LEVELS = (1, 2, 3, 4, 6, 8)  # default numbers of functions of a field


@dataclass(frozen=True, eq=False)
class FunctionKind:
    """A case with one type of functions in all bodies that have functions.

    study: convergence of the quantity with their number, None where it has no value; problem: the reason; seconds: time
    of all its runs.
    """

    kind: str
    study: Convergence | None
    seconds: float = math.nan
    problem: str = ""


@dataclass(frozen=True, eq=False)
class FunctionStudy:
    """Types of functions, each over their number, assessed against the best value of all."""

    title: str
    tolerance: float
    kinds: tuple[FunctionKind, ...]
    case_kinds: Mapping[str, str]
    over: str = "functions"

    @property
    def with_values(self) -> list[tuple[str, Convergence]]:
        """Types with values."""
        return [(kind.kind, kind.study) for kind in self.kinds if kind.study is not None]

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return next((study.unit for _, study in self.with_values), "")

    @property
    def reference(self) -> tuple[str, Convergence] | None:
        """The type whose last change is the smallest, of those with more than one value."""
        several = [pair for pair in self.with_values if len(pair[1].values) > 1]
        return min(several, key=lambda pair: abs(pair[1].changes[-1]), default=None)

    @property
    def scale(self) -> float:
        """Size of the reference's last value; 1 where it vanishes."""
        best = self.reference
        return 1.0 if best is None else abs(float(best[1].values[-1])) or 1.0

    def differences(self, study: Convergence) -> np.ndarray:
        """Relative differences of a type's values (n,) from the last value of the reference."""
        best = self.reference
        assert best is not None
        return np.asarray(np.abs(study.values - best[1].values[-1]) / self.scale)

    def enough(self, study: Convergence) -> int | None:
        """The smallest number of a type's functions from which on all values are within the tolerance."""
        acceptable = self.differences(study) <= self.tolerance
        if not acceptable[-1]:
            return None
        unacceptable = np.flatnonzero(~acceptable)
        return int(study.levels[int(unacceptable[-1]) + 1 if unacceptable.size else 0])

    @property
    def reference_is_settled(self) -> bool:
        """Whether the reference is trusted: its last change, or another type's last value, is within the tolerance."""
        best = self.reference
        if best is None:
            return False
        if abs(best[1].changes[-1]) <= self.tolerance * self.scale:
            return True
        last_differences = [self.differences(study)[-1] for kind, study in self.with_values if kind != best[0]]
        return bool(last_differences) and min(last_differences) <= self.tolerance

    @property
    def choice(self) -> tuple[str, int] | None:
        """Type and number of functions with the fewest coordinates within the tolerance; the first type of two alike.

        None where no type settles.
        """
        if not self.reference_is_settled:
            return None
        fits = []
        for rank, (kind, study) in enumerate(self.with_values):
            level = self.enough(study)
            if level is not None:
                fits.append((int(study.counts[study.levels == level][0]), rank, kind, level))
        return min(fits)[2:] if fits else None

    @property
    def recommended(self) -> str | None:
        """The choice in words, such as "polynomial, 4"."""
        return None if self.choice is None else f"{self.choice[0]}, {self.choice[1]}"

    @cached_property
    def verdict(self) -> str:
        """The conclusions, in sentences."""
        best = self.reference
        failed = [each for each in self.kinds if each.study is None]
        sentences = [f"{each.kind.capitalize()} functions have no value: {each.problem}." for each in failed]
        if best is None:
            return " ".join([*sentences, "Nothing can be compared."])
        for kind, study in self.with_values:
            level, enough = self.enough(study), "suffice"
            if level is None:
                level, enough = int(study.levels[-1]), "are too few"
            off = self.differences(study)[study.levels == level][0]
            sentences.append(f"{kind.capitalize()}: {level} per field {enough} ({off:.2g} off).")
        sentences.append(f"Differences are from {best[0]} with {best[1].levels[-1]} per field, relative.")
        if self.choice is None:
            sentences.append(f"No type settles within the tolerance {self.tolerance:g}; try more functions.")
        else:
            sentences.append(f"Choose {self.choice[0]}, {self.choice[1]} per field.")
        return " ".join(sentences)


def function_kinds(
    case: Case,
    levels: Sequence[int] | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> FunctionStudy:
    """The FunctionStudy of a case's [study] quantity; all bodies with functions use each type in turn.

    levels: numbers of functions of a field; left out, those of the case, or 1 to 8.

    Raises ValueError when the case has no [study] or no body with functions.
    """
    table = require_study(case)
    names = varied_names(case, "functions")
    counts = sorted(set(levels or table.modes or LEVELS))
    kinds = kinds_of(case, names)
    results = []
    for k, kind in enumerate(kinds):
        partial_progress = None if progress is None else (lambda x, k=k: progress((k + x) / len(kinds)))
        results.append(_kind(with_function_kind(case, names, kind), kind, counts, tolerance, partial_progress))
    case_kinds = {name: _case_kind_text(case.bodies[name]) for name in names}
    return FunctionStudy(quantity_text(table.quantity), tolerance or table.tolerance, tuple(results), case_kinds)


def kinds_of(case: Case, names: Sequence[str]) -> list[str]:
    """Types of functions that all these bodies can take."""
    every = [*CHARACTERISTIC, "polynomial", "elements"]
    return [kind for kind in every if all(kind in _kind_updates(case.bodies[name]) for name in names)]


def _kind_updates(table: BodyTable) -> dict[str, dict[str, Any]]:
    """Type -> changes in the table of a body's functions."""
    assert isinstance(table, AnalyticTable | DeployingTable) and table.functions is not None
    declared = type(table.functions).model_fields
    options = {"characteristic": CHARACTERISTIC["characteristic"], "polynomial": POLYNOMIAL}
    if isinstance(table, AnalyticTable):
        if table.functions.ends == "clamped-free":
            options["characteristic, static"] = CHARACTERISTIC["characteristic, static"]
    else:
        if table.family == "beam":
            options |= CHARACTERISTIC
        if table.family in ("beam", "plate") or table.tension:
            options["elements"] = ELEMENTS
    return {kind: {key: value for key, value in change.items() if key in declared} for kind, change in options.items()}


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
    family = f.family or "by default"
    added = "".join(f", {key}" for key in ("static", "tip") if getattr(f, key, False))
    return f"{family}{added}, {max(f.y, f.z, getattr(f, 'axial', 0), getattr(f, 'torsion', 0))}"


def _kind(
    case: Case, kind: str, levels: Sequence[int], tolerance: float | None, progress: Progress | None
) -> FunctionKind:
    """Study of one type of functions over their number; a type without a value has the reason as its problem."""
    usable = [n for n in levels if n >= LEAST.get(kind, 1)]
    if len(usable) < 2:
        return FunctionKind(kind, None, problem=f"at least two numbers from {LEAST.get(kind, 1)} on are needed")
    points: list[Point] = []
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # coarse levels are expected to be inaccurate
        try:
            study = plan_study(case, "modes", usable)
            points.extend(study.points(progress))
        except (IntegrationError, ValueError) as error:
            return FunctionKind(kind, None, problem=reason_without_value(case, error))
    return FunctionKind(kind, assess_convergence(study, points, tolerance), time.perf_counter() - start)
