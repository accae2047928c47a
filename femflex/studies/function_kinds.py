"""Types of admissible functions compared: which type, and how many of them, a quantity needs."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from femflex.case import Case, CaseError
from femflex.case.body import AnalyticTable, BodyTable
from femflex.case.deploying import DeployingTable
from femflex.integrate import IntegrationError
from femflex.studies.convergence import Convergence, assessed
from femflex.studies.ladder import varied
from femflex.studies.level import with_level
from femflex.studies.study import Point, Progress, described, planned, require_study
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
LEVELS = (1, 2, 3, 4, 6, 8)  # numbers of functions of a field that are tried when none are named


@dataclass(frozen=True, eq=False)
class FunctionKind:
    """A case with one type of functions in all bodies that have functions.

    found: how the quantity converges with their number, None where it has no value; problem: why not; seconds: of all
    its runs.
    """

    kind: str
    found: Convergence | None
    seconds: float = math.nan
    problem: str = ""


@dataclass(frozen=True, eq=False)
class FunctionStudy:
    """Types of functions, each over their number, judged against the best value of all."""

    title: str
    tolerance: float
    kinds: tuple[FunctionKind, ...]
    own: Mapping[str, str]
    over: str = "functions"

    @property
    def with_values(self) -> list[tuple[str, Convergence]]:
        """Types with values."""
        return [(one.kind, one.found) for one in self.kinds if one.found is not None]

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return next((found.unit for _, found in self.with_values), "")

    @property
    def reference(self) -> tuple[str, Convergence] | None:
        """The type whose last change is the smallest, of those with more than one value."""
        several = [one for one in self.with_values if len(one[1].values) > 1]
        return min(several, key=lambda one: abs(one[1].changes[-1]), default=None)

    @property
    def scale(self) -> float:
        """Size of the reference's last value; 1 where it vanishes."""
        best = self.reference
        return 1.0 if best is None else abs(float(best[1].values[-1])) or 1.0

    def differences(self, found: Convergence) -> np.ndarray:
        """Of a type's values (n,) from the reference's last one, relative."""
        best = self.reference
        assert best is not None
        return np.asarray(np.abs(found.values - best[1].values[-1]) / self.scale)

    def enough(self, found: Convergence) -> int | None:
        """The least number of a type's functions from which on all values are within the tolerance."""
        within = self.differences(found) <= self.tolerance
        if not within[-1]:
            return None
        bad = np.flatnonzero(~within)
        return int(found.levels[int(bad[-1]) + 1 if bad.size else 0])

    @property
    def settled(self) -> bool:
        """Whether the reference is trusted: its last change, or another type's last value, is within the tolerance."""
        best = self.reference
        if best is None:
            return False
        if abs(best[1].changes[-1]) <= self.tolerance * self.scale:
            return True
        others = [self.differences(found)[-1] for kind, found in self.with_values if kind != best[0]]
        return bool(others) and min(others) <= self.tolerance

    @property
    def chosen(self) -> tuple[str, int] | None:
        """Type and number of functions with the fewest coordinates within the tolerance; the first type of two alike.

        None where no type settles.
        """
        if not self.settled:
            return None
        fits = []
        for place, (kind, found) in enumerate(self.with_values):
            level = self.enough(found)
            if level is not None:
                fits.append((int(found.counts[found.levels == level][0]), place, kind, level))
        return min(fits)[2:] if fits else None

    @property
    def recommended(self) -> str | None:
        """The choice in words, such as "polynomial, 4"."""
        return None if self.chosen is None else f"{self.chosen[0]}, {self.chosen[1]}"

    @cached_property
    def verdict(self) -> str:
        """What this means, in sentences."""
        best, said = self.reference, []
        for one in self.kinds:
            if one.found is None:
                said.append(f"{one.kind.capitalize()} functions have no value: {one.problem}.")
        if best is None:
            return " ".join([*said, "Nothing can be compared."])
        for kind, found in self.with_values:
            level, last = self.enough(found), f"{self.differences(found)[-1]:.2g}"
            if level is None:
                said.append(f"{kind.capitalize()}: {found.levels[-1]} per field are too few ({last} off).")
            else:
                off = self.differences(found)[found.levels == level][0]
                said.append(f"{kind.capitalize()}: {level} per field suffice ({off:.2g} off).")
        said.append(f"Differences are from {best[0]} with {best[1].levels[-1]} per field, relative.")
        if self.chosen is None:
            return " ".join([*said, f"No type settles within the tolerance {self.tolerance:g}; try more functions."])
        return " ".join([*said, f"Choose {self.chosen[0]}, {self.chosen[1]} per field."])

    def to_dict(self) -> dict[str, Any]:
        """Everything in plain numbers, lists and text."""
        kinds = [
            {"kind": one.kind, "problem": one.problem, "seconds": one.seconds}
            | ({} if one.found is None else {"study": one.found.to_dict(), "enough": self._enough_of(one.found)})
            for one in self.kinds
        ]
        summary = {key: getattr(self, key) for key in ("unit", "over", "tolerance", "recommended", "verdict")}
        return {"quantity": self.title, **summary, "own": dict(self.own), "kinds": kinds}

    def _enough_of(self, found: Convergence) -> int | None:
        return None if self.reference is None else self.enough(found)


def function_kinds(
    case: Case,
    levels: Sequence[int] | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> FunctionStudy:
    """The FunctionStudy of a case's [study] quantity; all bodies with functions take each type in turn.

    levels: numbers of functions of a field; left out, those of the case, or 1 to 8.

    Raises ValueError when the case has no [study] or no body with functions.
    """
    table = require_study(case)
    names = function_names(case)
    wanted = sorted(set(levels or table.modes or LEVELS))
    kinds = kinds_of(case, names)
    found = []
    for k, kind in enumerate(kinds):
        part = None if progress is None else (lambda x, k=k: progress((k + x) / len(kinds)))
        found.append(_kind(with_functions_of(case, names, kind), kind, wanted, tolerance, part))
    own = {name: _own_kind(case.bodies[name]) for name in names}
    return FunctionStudy(described(table.quantity), tolerance or table.tolerance, tuple(found), own)


def function_names(case: Case) -> list[str]:
    """Names of the bodies that a study over functions varies. Raises ValueError when there is none."""
    return varied(case, _has_functions, "functions to vary")


def _has_functions(table: BodyTable) -> bool:
    return isinstance(table, AnalyticTable | DeployingTable) and table.functions is not None


def kinds_of(case: Case, names: Sequence[str]) -> list[str]:
    """Types of functions that all these bodies can take."""
    every = [*CHARACTERISTIC, "polynomial", "elements"]
    return [kind for kind in every if all(kind in _choices(case.bodies[name]) for name in names)]


def _choices(table: BodyTable) -> dict[str, dict[str, Any]]:
    """Type -> what it changes in the table of a body's functions."""
    assert isinstance(table, AnalyticTable | DeployingTable) and table.functions is not None
    known = type(table.functions).model_fields
    found = {"characteristic": CHARACTERISTIC["characteristic"], "polynomial": POLYNOMIAL}
    if isinstance(table, AnalyticTable):
        if table.functions.ends == "clamped-free":
            found["characteristic, static"] = CHARACTERISTIC["characteristic, static"]
    else:
        if table.family == "beam":
            found |= CHARACTERISTIC
        if table.family in ("beam", "plate") or table.tension:
            found["elements"] = ELEMENTS
    return {kind: {key: value for key, value in change.items() if key in known} for kind, change in found.items()}


def with_functions_of(case: Case, names: Sequence[str], kind: str, level: int | None = None) -> Case:
    """The case with that type of functions in these bodies, and `level` of them a field where it is given."""
    bodies: dict[str, Any] = dict(case.bodies)
    for name in names:
        table = bodies[name]
        assert isinstance(table, AnalyticTable | DeployingTable) and table.functions is not None
        functions = table.functions.model_copy(update=_choices(table)[kind])
        changed = table.model_copy(update={"functions": functions})
        bodies[name] = changed if level is None else with_level(changed, "modes", level)
    return case.model_copy(update={"bodies": bodies})


def _own_kind(table: BodyTable) -> str:
    """Type and numbers of the functions that a case gives a body."""
    f: Any = table.functions  # type: ignore[attr-defined]
    family = f.family or "by default"
    more = "".join(f", {key}" for key in ("static", "tip") if getattr(f, key, False))
    return f"{family}{more}, {max(f.y, f.z, getattr(f, 'axial', 0), getattr(f, 'torsion', 0))}"


def _kind(
    case: Case, kind: str, levels: Sequence[int], tolerance: float | None, progress: Progress | None
) -> FunctionKind:
    """One type of functions over their number; a type without any value says why."""
    usable = [n for n in levels if n >= LEAST.get(kind, 1)]
    if len(usable) < 2:
        return FunctionKind(kind, None, problem=f"at least two numbers from {LEAST.get(kind, 1)} on are needed")
    points: list[Point] = []
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # of coarse levels it is known that they are coarse
        try:
            study = planned(case, "modes", usable)
            points.extend(study.points(progress))
        except IntegrationError as error:
            return FunctionKind(kind, None, problem=f"it diverges at t = {error.t:.4g} s")
        except CaseError as error:
            return FunctionKind(kind, None, problem=error.problems[0].text.rstrip("."))
        except ValueError as error:
            return FunctionKind(kind, None, problem=str(error).removeprefix(f"{case.path.name}: ").rstrip("."))
    return FunctionKind(kind, assessed(study, points, tolerance), time.perf_counter() - start)
