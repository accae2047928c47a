"""Levels, forms of strain and types of functions that have no value, each with the reason in words."""

from __future__ import annotations

import math
import warnings
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.case import CaseError
from femflex.case.problems import Problem
from femflex.integrate import IntegrationError
from femflex.studies.function_kinds import FunctionKind, _kind
from femflex.studies.ladder import Built, Ladder, Rung
from femflex.studies.strain_forms import StrainForm, _form
from femflex.studies.study import Point, Study, watched
from femflex.warning import PhysicsWarning

MODULE = {name: import_module(f"femflex.studies.{name}") for name in ("function_kinds", "strain_forms", "study")}
CASE: Any = SimpleNamespace(path=SimpleNamespace(name="craft.toml"), bodies={})
DIVERGED = IntegrationError("numbers", np.array([0.0, 2.5]), np.zeros((2, 1)), 0, None)  # type: ignore[arg-type]
REFUSED = CaseError("craft.toml", [Problem("bodies.boom", "found too few."), Problem("run", "and more.")])
REASONS = [
    (DIVERGED, "it diverges at t = 2.5 s"),
    (REFUSED, "found too few"),
    (ValueError("craft.toml: no such mode."), "no such mode"),
]


def raising(error: Exception) -> Any:
    def call(*args: Any, **kwargs: Any) -> Any:
        raise error

    return call


@pytest.mark.parametrize(("error", "reason"), REASONS)
def test_a_type_of_functions_without_a_value_says_why(monkeypatch, error, reason):
    monkeypatch.setattr(MODULE["function_kinds"], "planned", raising(error))
    assert repr(_kind(CASE, "power", [1, 2], None, None)) == repr(FunctionKind("power", None, problem=reason))
    lowest = MODULE["function_kinds"].LEAST.get("power", 1)
    few = FunctionKind("power", None, problem=f"at least two numbers from {lowest} on are needed")
    assert repr(_kind(CASE, "power", [lowest], None, None)) == repr(few)


@pytest.mark.parametrize(("error", "reason"), REASONS)
def test_a_form_of_strain_without_a_value_says_why(monkeypatch, error, reason):
    body = SimpleNamespace(n_modes=3, kinds=("mode", "derivative", "mode", "derivative", "derivative"))
    monkeypatch.setattr(MODULE["strain_forms"], "build_part", lambda case, name: body)
    monkeypatch.setattr(Study, "value", raising(error))
    text = reason if error is DIVERGED else str(error).removeprefix("craft.toml: ")
    assert repr(_form(CASE, ["a", "b"], "condensed")) == repr(StrainForm("condensed", 6, 2, 4, problem=text))
    monkeypatch.setattr(MODULE["strain_forms"], "build_part", raising(REFUSED))
    assert repr(_form(CASE, ["a"], "linear")) == repr(StrainForm("linear", 0, 0, 0, problem="found too few."))


class Levels:
    """A study of made-up levels: (level, count, value or what it raises), each warning as it is built."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, of: str, *levels: tuple[int, int, Any]) -> None:
        values = {}

        def build(level: int, count: int) -> Built:
            warnings.warn(f"level {level}", PhysicsWarning, stacklevel=2)
            return Built({"a": level}, count, 1e-3)

        def value(own: Study, built: Built, progress: Any) -> tuple[float, str, float]:
            found = values[built.bodies["a"]]
            if isinstance(found, Exception):
                raise found
            return found, "Hz", 1e-9

        rungs = []
        for level, count, found in levels:
            values[level] = found
            rungs.append(Rung(level, float(count), lambda level=level, count=count: build(level, count)))  # type: ignore[misc]
        monkeypatch.setattr(Study, "value", value)
        case: Any = SimpleNamespace(path=CASE.path, study=SimpleNamespace(quantity=SimpleNamespace(of=of)))
        self.study, self.told = Study(case, "modes", Ladder(("a",), tuple(rungs), None)), list[float]()

    def points(self) -> list[Point]:
        return list(self.study.points(self.told.append))


@pytest.mark.filterwarnings("error")
def test_levels_that_add_nothing_are_left_out_and_too_coarse_ones_say_why(monkeypatch):
    coarse = ValueError("craft.toml: the craft has no mode 3")
    levels = Levels(
        monkeypatch, "system_frequency", (1, 10, coarse), (2, 20, 5.0), (3, 20, 6.0), (4, 30, -4.0), (5, 40, 4.5)
    )
    with pytest.warns(PhysicsWarning) as seen:
        points = levels.points()
    assert [str(one.message) for one in seen] == ["level 5"]  # of coarse levels it is known that they are coarse
    assert [one.level for one in points] == [1, 2, 4, 5]
    assert repr(points[0]) == repr(Point(1, 10, math.nan, math.nan, problem="the craft has no mode 3"))
    assert [(one.count, one.value, one.unit) for one in points[1:]] == [
        (20, 5.0, "Hz"),
        (30, -4.0, "Hz"),
        (40, 4.5, "Hz"),
    ]
    assert [one.noise for one in points[1:]] == pytest.approx([5e-3, 4e-3, 4.5e-3])
    assert levels.told == pytest.approx([0.0, 10 / 120, 30 / 120, 50 / 120, 80 / 120])


@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
@pytest.mark.parametrize("of", ["system_frequency", "mode_frequency", "peak"])
def test_errors_end_a_study_once_a_level_has_a_value_at_the_last_level_and_where_more_modes_do_not_help(
    monkeypatch, of
):
    missing = ValueError("craft.toml: no such mode")
    for levels in ([(1, 10, 5.0), (2, 20, missing), (3, 30, 5.0)], [(1, 10, missing), (2, 20, missing)]):
        with pytest.raises(ValueError, match="no such mode"):
            Levels(monkeypatch, of, *levels).points()
    first = [(1, 10, missing), (2, 20, 5.0)]
    if of == "peak":
        with pytest.raises(ValueError, match="no such mode"):
            Levels(monkeypatch, of, *first).points()
    else:
        assert [bool(one.problem) for one in Levels(monkeypatch, of, *first).points()] == [True, False]
    initial = CaseError("craft.toml", [Problem("bodies.a.initial", "too few")])
    both = CaseError("craft.toml", [Problem("bodies.a.initial", "too few"), Problem("run", "bad")])
    assert Levels(monkeypatch, "peak", (1, 10, initial), (2, 20, 5.0)).points()[0].problem.endswith("too few")
    with pytest.raises(CaseError):
        Levels(monkeypatch, "peak", (1, 10, both), (2, 20, 5.0)).points()


def test_a_run_that_is_watched_gives_its_rows_or_its_divergence(monkeypatch):
    blocks = [
        SimpleNamespace(times=np.array(t), states=np.array(t), t=last)
        for t, last in (([0.0, 1.0], 1.0), ([], 2.0), ([3.0], 4.0))
    ]
    model = SimpleNamespace(x0=np.zeros(1), observe=lambda times, states: {"a/b": 10 * states, "other": 0 * states})
    prepared: Any = SimpleNamespace(
        model=model,
        times=np.array([0.0, 1.0, 4.0]),
        integrator=SimpleNamespace(blocks=lambda model, times, x0: iter(blocks)),
    )
    told: list[float] = []
    guard = SimpleNamespace(divergence=lambda block: None)
    monkeypatch.setattr(MODULE["study"], "MotionGuard", lambda model: guard)
    assert watched(prepared, "a/b", told.append).tolist() == [0.0, 10.0, 30.0] and told == [0.25, 0.5, 1.0]
    guard.divergence = lambda block: DIVERGED if block.t > 1.0 else None
    with pytest.raises(IntegrationError) as caught:
        watched(prepared, "a/b", told.append)
    assert caught.value is DIVERGED and told[3:] == [0.25]
