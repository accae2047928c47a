"""Verbs step by step: what they pass to the library, what they print of its answers, and what an interrupt leaves."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
from test_choices_of_verbs import study
from test_printed_numbers import campbell, lines
from test_whole_texts import raising, rest

import femflex.cli
import femflex.cli.interrupt
from femflex.case import parse_case, read_case
from femflex.cli import campbell as campbell_verb
from femflex.cli import check, info, interrupt, linearize, run, second_run, stability, stress, sweep, warning_output
from femflex.cli import converge as converge_verb
from femflex.cli.converge_report import StudyOutputs
from femflex.cli.keep_alive import keep_alive
from femflex.cli.progress import Bar
from femflex.cli.verb import verb
from femflex.dynamics.equilibria.equilibrium import EquilibriumError
from femflex.integrate import IntegrationError, Steps
from femflex.results import interrupts
from femflex.warning import CacheWarning, PhysicsWarning

HUB = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"
DIAGRAM = HUB + "[campbell]\nspeeds = '0:120 rpm:5'\naxis = [0, 0, 1]\nmodes = 3\n"


@pytest.fixture
def bars(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """Text, end and unit of the progress bars, with what they were called with."""
    kept: list[tuple[Any, ...]] = []

    def call(self: Any, reached: float, end: float | None = None) -> None:
        kept.append((self._text, self._end, self._unit, reached))

    monkeypatch.setattr(Bar, "__call__", call)
    return kept


def failed(text: str) -> IntegrationError:
    return IntegrationError(text, np.array([1.0, 2.25]), np.zeros((2, 1)), 0, Steps(3, 1, 9, 0.1, 0.5))


# diagrams of frequencies


def steps_until(stop: BaseException | None, count: int = 2) -> Any:
    """A generator of steps that reports progress, and is broken off by an error if there is one."""

    def steps(*words: Any) -> Iterator[str]:
        asked.append(words)
        report = next(word for word in words if callable(word))
        for k in range(count):
            report(5.0 + k)
            yield f"step {k}"
        if stop is not None:
            raise stop

    asked: list[tuple[Any, ...]] = []
    steps.asked = asked  # type: ignore[attr-defined]
    return steps


STOPS = [None, KeyboardInterrupt("interrupted here"), EquilibriumError("there is none", None)]  # type: ignore[arg-type]


@pytest.mark.parametrize("stop", STOPS, ids=["whole", "interrupted", "no equilibrium"])
def test_a_diagram_over_a_value_is_reported_as_far_as_it_goes(
    stop: Any, femflex: Any, monkeypatch: pytest.MonkeyPatch, bars: Any, tmp_path: Path
):
    (tmp_path / "c.toml").write_text("title = 'a hub'\n" + HUB)
    steps, made, named = steps_until(stop), [], []
    place = "femflex.studies.campbell"
    monkeypatch.setattr(f"{place}.value_motions", steps)
    monkeypatch.setattr(f"{place}.assembled_diagram", lambda *words: made.append(words) or "diagram")
    shown = campbell(value="bodies.hub.mass", unit="kg", to_dict=lambda: {"branches": 2})
    monkeypatch.setattr(f"{place}.over_value", lambda *words: named.append(words) or shown)
    monkeypatch.setattr("femflex.view.campbell.plot_campbell", lambda *words, **more: None)
    vary = "bodies.hub.mass=2 kg:4 kg:3"
    code, out, err = femflex("campbell", "c.toml", "--vary", vary, "-o", "d.csv", "-o", "d.png")
    assert code == (0 if stop is None else 130 if isinstance(stop, KeyboardInterrupt) else 1)
    assert stop is None or str(stop) in err
    ((case, key, values, unit, modes, _),) = steps.asked
    assert (case.title, key, values, unit, modes) == ("a hub", "bodies.hub.mass", [2.0, 3.0, 4.0], "kg", 6)
    assert made == [(["step 0", "step 1"], 6, (), "a hub", stop is None)]
    assert named == [("diagram", "bodies.hub.mass", "kg")]
    assert bars == [("varying", 2.0, "kg", 3.0), ("varying", 2.0, "kg", 4.0)]
    text = out.splitlines()
    assert text[:2] == ["blade", "frequency, Hz (* unstable)"] and text[-2:] == [
        "table       d.csv",
        "picture     d.png",
    ]
    assert text[2].split() == ["bodies.hub.mass", "kg", "flap", "lag"] and ["2", "2.25*"] in [
        row.split() for row in text
    ]
    code, out, _ = femflex("campbell", "c.toml", "--vary", vary, "--json", "--modes", 2, "-o", "e.csv")
    assert json.loads(out) == {"branches": 2} and steps.asked[1][4] == 2 and (tmp_path / "e.csv").is_file()


def test_a_diagram_over_a_value_that_finds_nothing_prints_nothing(femflex: Any, monkeypatch: Any, tmp_path: Path):
    (tmp_path / "c.toml").write_text(HUB)
    monkeypatch.setattr("femflex.studies.campbell.value_motions", steps_until(KeyboardInterrupt(), 0))
    found = femflex("campbell", "c.toml", "--vary", "bodies.hub.mass=2:4:3")
    assert found == (130, "", "femflex: interrupted\n")
    for option, words in (("--orders", "1,2"), ("--at", "2")):
        code, out, err = femflex("campbell", "c.toml", "--vary", "bodies.hub.mass=2:4:3", option, words)
        sentence = f"found {option}, which goes with speeds and not with bodies.hub.mass"
        assert (code, out, err) == (2, "", f"femflex: {sentence}\n")


@pytest.mark.parametrize("stop", STOPS, ids=["whole", "interrupted", "no equilibrium"])
def test_the_diagram_of_a_case_is_kept_as_far_as_it_goes(stop: Any, monkeypatch: pytest.MonkeyPatch, bars: Any):
    case, steps, made = parse_case(DIAGRAM), steps_until(stop), []
    monkeypatch.setattr("femflex.studies.campbell.case_spins", steps)
    monkeypatch.setattr("femflex.studies.campbell.diagram_of", lambda *words: made.append(words) or "diagram")
    decided: Any = object()
    assert campbell_verb.computed_diagram(case, 2.5, decided) == ("diagram", stop)
    assert made == [(case, ["step 0", "step 1"], stop is None)]
    ((own, at, _, given),) = steps.asked
    assert (own, at, given) == (case, 2.5, decided) and not interrupts.has_work_to_finish()
    rpm = 2 * np.pi / 60
    assert [bar[:3] for bar in bars] == [("spinning", pytest.approx(120.0), "rpm")] * 2
    assert [bar[3] for bar in bars] == pytest.approx([5 / rpm, 6 / rpm])
    monkeypatch.setattr("femflex.studies.campbell.case_spins", steps_until(stop or KeyboardInterrupt(), 0))
    found, why = campbell_verb.computed_diagram(case)
    assert found is None and why is not None and len(made) == 1


def test_an_interrupt_waits_for_a_diagram_once_it_has_begun(monkeypatch: pytest.MonkeyPatch):
    kept = []

    def steps(*words: Any) -> Iterator[int]:
        kept.append(interrupts.has_work_to_finish())
        yield 1
        kept.append(interrupts.has_work_to_finish())

    monkeypatch.setattr("femflex.studies.campbell.case_spins", steps)
    monkeypatch.setattr("femflex.studies.campbell.diagram_of", lambda *words: None)
    campbell_verb.computed_diagram(parse_case(DIAGRAM))
    assert kept == [False, True]


def expecting(value: float) -> str:
    return DIAGRAM + (
        f"[expect.flap]\nof = 'campbell_frequency'\nbranch = 'flap 1'\nspeed = '30 rpm'\nvalue = {value}\n"
        "tolerance = 0.5\nsource = 'x'\n"
    )


def test_a_run_leaves_the_diagram_of_its_case_beside_it(monkeypatch: pytest.MonkeyPatch, capsys: Any, tmp_path: Path):
    found, drawn = campbell(complete=True, frequency=lambda branch, speed: 2.25), []
    monkeypatch.setattr("femflex.view.campbell.plot_campbell", lambda *words, **more: drawn.append((words, more)))
    answers = [(found, None)]
    monkeypatch.setattr(campbell_verb, "computed_diagram", lambda case: answers[-1])
    output = tmp_path / "r.h5"
    assert campbell_verb.write_diagram_files(parse_case(expecting(2.0)), output, force=False) == []
    text = lines(capsys)
    table, picture = tmp_path / "r_campbell.csv", tmp_path / "r_campbell.png"
    assert text[:2] == ["", "blade"] and table.is_file()
    assert text[-3:-1] == [f"table       {table}", f"picture     {picture}"]
    assert text[-1].startswith("expected    flap: 2.25 Hz") and text[-1].endswith(": holds")
    rpm = pytest.approx(2 * np.pi / 60)
    assert drawn == [((found, picture, "light", rpm, "rpm"), {"force": False})]
    with pytest.raises(FileExistsError):
        campbell_verb.write_diagram_files(parse_case(expecting(2.0)), output, force=False)
    dark = parse_case(expecting(7.0) + "[pictures]\ntheme = 'dark'\n")
    assert campbell_verb.write_diagram_files(dark, output, force=True) == ["flap"]
    assert drawn[-1] == ((found, picture, "dark", rpm, "rpm"), {"force": True})
    assert lines(capsys)[-1].endswith("does not hold")
    answers.append((campbell(complete=False), EquilibriumError("there is none", None)))  # type: ignore[arg-type]
    with pytest.raises(EquilibriumError, match="there is none"):
        campbell_verb.write_diagram_files(dark, output, force=True)
    said = capsys.readouterr()
    assert (
        said.err == "femflex: broken off after 3 of 5 speeds\n" and "expected" not in said.out and "blade" in said.out
    )
    answers.append((None, KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        campbell_verb.write_diagram_files(dark, output, force=True)
    assert capsys.readouterr().out == ""


def test_the_verb_prints_notes_and_the_diagram_or_json(femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "c.toml").write_text(expecting(2.0))
    decided = SimpleNamespace(notes={"hub": "a note"}, advice=[], system=SimpleNamespace(bodies={}))
    found = campbell(complete=True, frequency=lambda branch, speed: 2.25, to_dict=lambda: {"branches": 2})
    asked = []
    monkeypatch.setattr("femflex.studies.campbell.decided_of", lambda case: decided)
    monkeypatch.setattr(campbell_verb, "computed_diagram", lambda *words: asked.append(words) or (found, None))
    code, out, _ = femflex("campbell", "c.toml", "--at", "1 min", "--modes", 4, "-o", "d.csv")
    text = out.splitlines()
    assert code == 0 and text[:2] == ["body        hub: a note", "blade"]
    assert text[-2] == "table       d.csv" and text[-1].endswith(": holds")
    ((case, at, given),) = asked
    assert (case.campbell.modes, at, given) == (4, 60.0, decided)
    code, out, _ = femflex("campbell", "c.toml", "--json")
    assert code == 0 and json.loads(out) == {"branches": 2, "bodies": {}}
    code, _, err = femflex("campbell", "c.toml", "--theme", "pink")
    assert code == 2 and "pink" in err and len(asked) == 2


# studies


FINDINGS = [
    study(to_dict=lambda: {"over": "modes"}),
    study(over="mesh", recommended=None, n_resolved=3, to_dict=lambda: {"over": "mesh"}),
]
CHOICE = "Choose modes = 2, mesh = 4: each study used the results of the ones before it."
CHOICE += " Over mesh the tolerance is not reached."


def outputs(**more: Any) -> StudyOutputs:
    return StudyOutputs(
        **{"tolerance": None, "as_json": False, "picture": None, "theme": "light", "force": False} | more
    )


def test_several_studies_are_reported_together(capsys: pytest.CaptureFixture[str]):
    notes = {"boom": "a note", "hub": ""}
    outputs().begin(notes)
    assert lines(capsys) == ["body        boom: a note"]
    outputs().report(FINDINGS, notes, complete=True)
    text = lines(capsys)
    assert all(len(line) <= 110 for line in text) and len(text) == 2
    assert text[0].startswith("together    Choose modes = 2, mesh = 4") and text[1].startswith(" " * 12)
    assert " ".join(" ".join(text).split()) == f"together {CHOICE}"
    outputs().report(FINDINGS[:1], notes, complete=True)
    outputs(as_json=True).begin(notes)
    outputs(as_json=True).say(FINDINGS[0])
    outputs(as_json=True).report([], notes, complete=True)
    assert lines(capsys) == []
    outputs(as_json=True).report(FINDINGS[:1], notes, complete=True)
    assert json.loads(capsys.readouterr().out) == {"over": "modes", "notes": notes}
    outputs(as_json=True).report(FINDINGS, notes, complete=True)
    assert json.loads(capsys.readouterr().out) == {
        "studies": [{"over": "modes"}, {"over": "mesh"}],
        "choice": {"modes": 2, "mesh": 4},
        "verdict": CHOICE,
        "notes": notes,
    }


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -1e-3, 2.5])
def test_a_tolerance_lies_between_0_and_1(tolerance: float):
    with pytest.raises(ValueError, match=f"--tolerance is {tolerance:g}; give a relative error between 0 and 1"):
        outputs(tolerance=tolerance).check()
    outputs(tolerance=0.5).check()


@pytest.mark.parametrize(("word", "name"), [("strain", "strain_forms"), ("functions", "function_kinds")])
def test_comparisons_report_their_progress_in_per_cent(word: str, name: str, monkeypatch: Any, bars: Any):
    asked = []
    answer = SimpleNamespace(own={"boom": 1, "wing": 2})

    def compare(*words: Any) -> Any:
        asked.append(words)
        words[-1](0.126)
        return answer

    monkeypatch.setattr(f"femflex.studies.{name}", compare)
    case: Any = object()
    found = converge_verb.run_study(case, word, [2, 3], 0.25)
    assert found == (answer, ("boom", "wing"), None)
    assert asked[0][:-1] == ((case, 0.25) if word == "strain" else (case, [2, 3], 0.25))
    assert bars[0] == ("comparing", 100.0, "%", 13.0)


POINTS = [SimpleNamespace(problem=""), SimpleNamespace(problem="too large")]


@pytest.mark.parametrize("stop", [None, KeyboardInterrupt(), failed("diverged")], ids=["whole", "interrupt", "failed"])
def test_a_study_is_judged_by_the_points_that_there_are(stop: Any, monkeypatch: Any, bars: Any, capsys: Any):
    kept, judged, asked = [], [], []

    class Planned:
        ladder = SimpleNamespace(rungs=[1, 2, 4, 8], varied=("boom",))

        def points(self, report: Any) -> Iterator[Any]:
            report(0.333)
            for point in points:
                kept.append(interrupts.has_work_to_finish())
                yield point
            if stop is not None:
                raise stop

    plan, case, points = Planned(), object(), POINTS
    monkeypatch.setattr("femflex.studies.planned", lambda *words: asked.append(words) or plan)
    monkeypatch.setattr("femflex.studies.assessed", lambda *words: judged.append(words) or "judged")
    found = converge_verb.run_study(case, "modes", [1, 2], 0.25)  # type: ignore[arg-type]
    assert found == ("judged", ("boom",), stop) and asked == [(case, "modes", [1, 2])]
    assert judged == [(plan, POINTS, 0.25, stop is None)] and kept == [False, True]
    assert bars[0] == ("converging", 100.0, "%", 33.0)
    assert capsys.readouterr().err == ("" if stop is None else "femflex: broken off after 2 of 4 levels\n")
    points = POINTS[1:]
    assert converge_verb.run_study(case, "modes", None, None) == (None, ("boom",), stop)  # type: ignore[arg-type]
    assert capsys.readouterr().err == ""


def test_a_study_that_is_broken_off_has_no_picture(femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "c.toml").write_text(HUB)
    asked, told = [], []
    monkeypatch.setattr("femflex.pipeline.case_bodies.with_strain_notes", lambda case: (case, {"hub": "a note"}))
    monkeypatch.setattr("femflex.studies.check_studies", lambda case, varied: told.append(varied))
    answers: list[Any] = [(FINDINGS[0], ("hub",), None), (FINDINGS[1], ("hub",), None)]
    monkeypatch.setattr(converge_verb, "run_study", lambda *words: asked.append(words) or answers[len(asked) - 1])
    monkeypatch.setattr("femflex.studies.with_choice", lambda case, found, names: (found.over, names))
    drawn: list[Any] = []
    monkeypatch.setattr("femflex.view.side_by_side.plot_studies", lambda *words, **more: drawn.append(words))
    code, out, _ = femflex("converge", "c.toml", "--over", "modes, mesh,modes", "--tolerance", "0.125", "-o", "s.png")
    text = out.splitlines()
    assert code == 0 and text[0] == "body        hub: a note" and text[-1] == "picture     s.png"
    assert told == [["modes", "mesh"]] and len(drawn) == 1
    assert [words[1:] for words in asked] == [("modes", None, 0.125), ("mesh", None, 0.125)]
    assert asked[1][0] == ("modes", ("hub",))
    asked.clear()
    answers[:] = [(FINDINGS[0], ("hub",), KeyboardInterrupt())]
    code, out, err = femflex("converge", "c.toml", "-o", "t.png", "--levels", "1 2")
    assert (code, err) == (130, "femflex: no picture is drawn\nfemflex: interrupted\n") and len(drawn) == 1
    assert "peak [m]" in out and asked[0][1:] == ("modes", [1, 2], None)
    asked.clear()
    answers[:] = [(None, ("hub",), KeyboardInterrupt())]
    assert femflex("converge", "c.toml", "-o", "t.png")[2] == "femflex: interrupted\n"


# runs


def prepared_of(case: Any, **more: Any) -> Any:
    system = SimpleNamespace(bodies={}, segments={})
    return SimpleNamespace(case=case, system=system, times=np.array([0.0, 2.5]), load_kernels=lambda: None, **more)


def test_the_options_of_a_run_reach_the_pipeline(femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    text = DIAGRAM + "[pictures]\nplots = ['e']\n"
    (tmp_path / "c.toml").write_text(text)
    asked: dict[str, list[Any]] = {}

    def keep(name: str, answer: Any = None) -> Any:
        def record(*words: Any, **more: Any) -> Any:
            asked.setdefault(name, []).append((words, more))
            return list(answer) if isinstance(answer, list) else answer

        return record

    @contextmanager
    def opened(path: Path) -> Iterator[str]:
        yield f"run of {path}"

    prepared = prepared_of(None)
    for name, answer in (("prepare", prepared), ("integrate", None), ("check_output", None), ("is_finished", False)):
        monkeypatch.setattr(f"femflex.pipeline.{name}", keep(name, answer))
    monkeypatch.setattr("femflex.results.open_run", opened)
    answers = {
        "print_run_heading": None, "print_run_summary": None, "print_verdicts": ["low"], "draw_pictures": None,
        "print_modes_verdicts": ["high"], "check_pictures": None, "check_left_out": None,
    }  # fmt: skip
    for name, answer in answers.items():
        monkeypatch.setattr(run, name, keep(name, answer))
    monkeypatch.setattr("femflex.cli.campbell.write_diagram_files", keep("diagram", ["flap"]))
    code, _, err = femflex("run", "c.toml", "-o", "r.h5", "--force")
    assert code == 0 and err == (
        "femflex: warning: the run is complete, but these expected values of the case do not hold: low, flap, high. "
        "Check the model, or correct [expect]\n"
    )
    case, output = asked["prepare"][0][0]
    assert output == Path("r.h5") and case.campbell is not None
    assert asked["prepare"][0][1] == {"force": True, "resume": False, "without": [], "linearised": False}
    assert asked["check_output"] == [((case, output), {"force": True, "resume": False})]
    assert asked["check_pictures"] == [((case, output), {"force": True})]
    ((given, path), more) = asked["integrate"][0]
    assert (given, path, more["force"], more["resume"], more["lock"].path) == (prepared, output, True, False, output)
    assert asked["print_run_summary"] == [(("run of r.h5", prepared.system, output), {})]
    assert asked["draw_pictures"] == [((prepared, "run of r.h5", output, True), {})]
    assert asked["diagram"] == [((case, output, True), {})] and "is_finished" not in asked
    asked.clear()
    code, _, err = femflex("run", "c.toml", "--without", "gyroscopic, ,K3", "--without", "damping", "--resume")
    assert code == 0 and "hold: low. Check" in err
    assert asked["prepare"][0][1] == {
        "force": False,
        "resume": True,
        "without": ["gyroscopic", "K3", "damping"],
        "linearised": False,
    }
    assert asked["integrate"][0][0][1] == Path("c.h5") and asked["integrate"][0][1]["resume"]
    assert {"draw_pictures", "check_left_out"} <= asked.keys()
    assert not {"diagram", "print_modes_verdicts", "check_output"} & asked.keys()
    asked.clear()
    assert femflex("run", "c.toml", "--linearised", "--no-pictures")[::2] == (0, "")
    left_out = {
        "draw_pictures",
        "check_pictures",
        "check_left_out",
        "print_verdicts",
        "print_modes_verdicts",
        "diagram",
    }
    assert asked["prepare"][0][1]["linearised"] and not left_out & asked.keys()
    asked.clear()
    monkeypatch.setattr("femflex.pipeline.is_finished", keep("is_finished", True))
    code, out, _ = femflex("run", "c.toml", "--resume")
    sentence = "c.h5 is complete already; there is nothing to resume (--force runs it anew)"
    assert (code, out) == (0, f"done        {sentence}\n") and asked.keys() == {"is_finished"}


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("stop", [None, failed("diverged")], ids=["whole", "failed"])
def test_the_second_run_is_kept_up_to_where_it_diverges(
    linear: bool, stop: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any, bars: Any
):
    more = "linearised = true" if linear else "without = ['gyroscopic', 'K3']"
    case, asked = parse_case(HUB + f"[pictures]\nplots = ['e']\n{more}\n"), []
    prepared = prepared_of(case)

    def integrate(*words: Any, progress: Any, **more: Any) -> None:
        asked.append((words, more))
        progress(1.5)
        warnings.warn("that is the purpose", PhysicsWarning, stacklevel=1)
        if stop is not None:
            raise stop

    @contextmanager
    def opened(path: Path) -> Iterator[str]:
        yield f"run of {path}"

    monkeypatch.setattr("femflex.pipeline.prepare", lambda *words, **more: asked.append((words, more)) or prepared)
    monkeypatch.setattr("femflex.pipeline.integrate", integrate)
    monkeypatch.setattr("femflex.results.open_run", opened)
    path = Path("r_linearised.h5") if linear else Path("r_without.h5")
    what = "linearised" if linear else "without gyroscopic, K3"
    with second_run.second_run(case, Path("r.h5"), force=True) as found:
        assert found == f"run of {path}"
    without = [] if linear else ["gyroscopic", "K3"]
    assert asked == [
        ((case, path), {"force": True, "without": without, "linearised": linear}),
        ((prepared, path), {"force": True}),
    ]
    ended = "reached the end" if stop is None else "stopped at t = 2.25 s, where it diverges"
    assert lines(capsys) == [f"compared    {what}: {path} {ended}"]
    assert bars == [(f"again {what}", 2.5, "s", 1.5)]
    with second_run.second_run(parse_case(HUB), Path("r.h5"), force=True) as found:
        assert found is None and len(asked) == 2


def test_what_the_second_run_leaves_out_is_looked_for_first(monkeypatch: pytest.MonkeyPatch):
    asked: list[Any] = []
    monkeypatch.setattr("femflex.pipeline.linear_motion.check", lambda system: asked.append(system))
    monkeypatch.setattr("femflex.dynamics.terms.without.resolved", lambda model, name: asked.append((model, name)))

    def check_of(more: str, omitted: tuple[str, ...] = ()) -> list[Any]:
        asked.clear()
        model = SimpleNamespace(omitted=omitted)
        case = parse_case(HUB + (f"[pictures]\n{more}\n" if more else ""))
        given = SimpleNamespace(case=case, system="system", model=model)
        second_run.check_left_out(given)  # type: ignore[arg-type]
        return [entry if entry == "system" else entry[1] for entry in asked]

    assert check_of("") == [] and check_of("plots = ['e']") == []
    assert check_of("linearised = true") == ["system"]
    assert check_of("without = ['a', 'b']") == ["a", "b"]
    assert check_of("without = ['a', 'b']", ("c",)) == []


# sweeps, linear models, charts


def test_a_sweep_is_reported_in_tables_and_in_json(
    femflex: Any, monkeypatch: pytest.MonkeyPatch, bars: Any, tmp_path: Path
):
    asked, drawn, began = [], [], []
    found: Any = SimpleNamespace(
        problems=["", "none converged", "", "a b", "c", "d"], percentiles=np.array([5.0, 97.5]), units={"peak": "m"},
        inputs={"mass": np.array([1.5, 2.5])}, outputs={"peak": np.array([0.25, np.nan])},
        of_outputs=lambda: {"peak": np.array([0.125, 0.375]), "other": np.array([1.0, 2.0])},
        sobol={"peak": np.array([[0.625, 0.75]])},
    )  # fmt: skip

    def swept(*words: Any, progress: Any, **more: Any) -> Any:
        asked.append((words, more))
        progress(3.0)
        if asked[-1][1]["workers"] == 3:
            raise KeyboardInterrupt
        return found

    module = sys.modules.get("femflex.studies.sweep.sweep") or __import__("femflex.studies.sweep.sweep", fromlist=["x"])
    monkeypatch.setattr("femflex.studies.sweep.sweep", swept)
    monkeypatch.setitem(sys.modules, "femflex.studies.sweep.sweep", module)
    monkeypatch.setattr(module, "count_of", lambda path: 6)
    monkeypatch.setattr(sweep, "started", began.append)
    monkeypatch.setattr(sweep, "draw", lambda *words: drawn.append(words))
    code, out, err = femflex("sweep", "study.toml", "-o", "a.png", "--theme", "dark", "--force", "--workers", 1)
    assert code == 0 and out.splitlines() == [
        "output    5 %  97.5 %  unit",
        "─" * 27,
        "peak    0.125   0.375  m",
        "other       1       2",
        "",
        "share in the variance of peak (Sobol indices)",
        "value  first order  total",
        "─" * 25,
        "mass         0.625   0.75",
        "",
        "runs        6, of which 4 failed",
        "kept        study.h5",
        "picture     a.png",
    ]
    assert err == "".join(f"femflex: run {k} failed: {found.problems[k]}\n" for k in (1, 3, 4))
    more = {"force": True, "resume": False, "workers": 1, "scheduler": None}
    assert asked == [((Path("study.toml"), Path("study.h5")), more)] and not began
    assert drawn == [(found, Path("a.png"), "study", ("dark", True), "")] and bars == [("sweeping", 6.0, "runs", 3.0)]
    code, out, _ = femflex("sweep", "study.toml", "-o", "a.png", "-o", "b.h5", "--json", "--resume", "--envelope")
    assert code == 0 and json.loads(out) == {
        "runs": 6, "inputs": {"mass": [1.5, 2.5]}, "outputs": {"peak": [0.25, None]}, "units": {"peak": "m"},
        "failed": [{"run": k, "problem": found.problems[k]} for k in (1, 3, 4, 5)], "percentiles": [5.0, 97.5],
        "percentiles_of_outputs": {"peak": [0.125, 0.375], "other": [1.0, 2.0]},
        "sobol_indices": {"peak": [[0.625, 0.75]]},
    }  # fmt: skip
    assert asked[1][0][1] == Path("b.h5") and asked[1][1]["resume"] and asked[1][1]["workers"] is None
    assert drawn[1][3:] == (("light", False), "envelope") and began == [["femflex.studies.sweep.member"]]
    assert femflex("sweep", "study.toml", "-o", "a.png", "--indices", "--scheduler", "tcp://a:1")[0] == 0
    assert drawn[2][4] == "indices" and asked[2][1]["scheduler"] == "tcp://a:1" and len(began) == 1
    code, _, err = femflex("sweep", "study.toml", "-o", "b.h5", "--workers", 3)
    assert (code, err) == (130, "femflex: interrupted; femflex sweep study.toml -o b.h5 --resume goes on\n")


def test_the_options_of_a_linear_model_reach_the_library(femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "c.toml").write_text(HUB)
    asked: dict[str, Any] = {}
    decided = SimpleNamespace(notes={"hub": "a note"}, advice=[], system="system")
    model: Any = SimpleNamespace(states=[0] * 9, about=rest([]), left_out=(), t=1.5)
    small: Any = SimpleNamespace(states=[0] * 5)

    def keep(name: str, answer: Any) -> Any:
        return lambda *words, **more: asked.__setitem__(name, (words, more)) or answer

    place = "femflex.studies.linear"
    monkeypatch.setattr("femflex.pipeline.balanced.decided_at_rest", lambda case: decided)
    monkeypatch.setattr(f"{place}.linear_model", keep("model", model))
    monkeypatch.setattr(f"{place}.modal_truncation", keep("modal", small))
    monkeypatch.setattr(f"{place}.balanced_truncation", keep("balanced", small))
    monkeypatch.setattr(f"{place}.instant.state_of_run", keep("state", (1.5, "state")))
    data = {"poles": [], "inputs": [], "outputs": []}
    monkeypatch.setattr(linearize, "model_data", keep("data", data))
    monkeypatch.setattr(linearize, "written", keep("written", [("model", Path("m.npz"))]))
    words = ["--inputs", "a, b", "--outputs", "c", "--at", "1 min", "--below", "2.5", "-o", "m.npz", "--theme", "dark"]
    code, out, _ = femflex("linearize", "c.toml", *words, "--zeros", "--force")
    text = out.splitlines()
    assert code == 0 and text[:2] == ["c.toml", "body        hub: a note"] and text[-1] == "model       m.npz"
    assert "states      5, of 9" in text
    assert asked["model"] == (("system", ["a", "b"], ["c"]), {"at": 60.0, "state": None})
    assert asked["modal"] == ((model, pytest.approx(2.5 * 2 * np.pi)), {}) and "balanced" not in asked
    assert asked["data"] == ((model, small, True), {})
    assert asked["written"] == ((small, {"model": Path("m.npz")}, "c", ("dark", True, False)), {})
    code, out, _ = femflex("linearize", "c.toml", "--run", "r.h5", "--at", "3", "--balanced", 4, "--nichols", "--json")
    assert code == 0 and json.loads(out) == data
    assert asked["state"] == ((Path("r.h5"), "system", 3.0), {})
    assert asked["model"] == (("system", None, None), {"at": 1.5, "state": "state"})
    assert asked["balanced"] == ((model, 4), {}) and asked["data"] == ((model, small, False), {})
    assert asked["written"] == ((small, {}, "c", ("light", False, True)), {})
    assert femflex("linearize", "c.toml")[0] == 0 and asked["data"] == ((model, model, False), {})


def test_a_chart_of_a_case_is_printed_written_and_drawn(femflex: Any, monkeypatch: Any, bars: Any, tmp_path: Path):
    (tmp_path / "c.toml").write_text("title = 'a hub'\n" + HUB)
    asked: list[Any] = []
    found = SimpleNamespace(found="chart")

    def charted(case: Any, bar: Any) -> Any:
        asked.append(case)
        bar(0.5)
        return found

    monkeypatch.setattr("femflex.studies.stability.case_stability", charted)
    monkeypatch.setattr(stability, "write_table", lambda *words: asked.append(words))
    monkeypatch.setattr(stability, "draw", lambda *words: asked.append(words))
    monkeypatch.setattr(stability, "print_stability_of", lambda one: print("the chart"))
    monkeypatch.setattr(stability, "stability_data", lambda one: {"found": one.found})
    words = ["--vary", "a=1:2:3", "--floquet", "--period", "2", "--without", "K3", "--theme", "dark", "--without", "K2"]
    code, out, err = femflex("stability", "c.toml", *words, "--force", "-o", "c.csv", "-o", "c.svg")
    assert code == 0, err
    assert out.splitlines() == ["a hub", "the chart", "table       c.csv", "picture     c.svg"]
    case, table, picture = asked
    assert (case.stability.of, case.stability.period, case.stability.without) == ("motion", 2, ["K3", "K2"])
    assert not case.stability.shooting
    assert table == ("chart", Path("c.csv"), True) and picture == (found, Path("c.svg"), "a hub", "dark", True)
    assert bars == [("charting", 1.0, "of the points", 0.5)]
    code, _, err = femflex("stability", "c.toml", "--vary", "a=1:2:3", "--period", "2 m")
    assert code == 2 and err.startswith("femflex: --period: ") and len(asked) == 3
    code, out, _ = femflex("stability", "c.toml", "--vary", "a=1:2:3", "--shooting", "--json")
    assert (code, json.loads(out)) == (0, {"found": "chart"}) and asked[3].stability.shooting


# check, info, stress


def test_a_checked_case_is_summed_up(femflex: Any, tmp_path: Path):
    """A hub of 2 kg on a hinge, and a mast of 3 kg with two bending shapes; the copy has the choices as keys."""
    text = HUB + (
        "[bodies.mast]\nkind = 'analytic'\nlength = 2\nEA = 1e6\nEIy = 400\nEIz = 300\nGJ = 100\nmass = 3\n"
        "functions = { y = 2 }\nstrain = 'linear'\n"
        "[[joints]]\nkind = 'revolute'\nchild = 'hub'\naxis = [0, 0, 1]\n"
        "[[joints]]\nkind = 'weld'\nparent = 'hub'\nchild = 'mast'\nchild_marker = 'root'\n"
    )
    (tmp_path / "c.toml").write_text(text)
    code, out, err = femflex("check", "c.toml", "--write-advice")
    first, *others = out.splitlines()
    warned = err.count("femflex: warning: ")
    verdict = f"no errors, {warned} warning{'s' * (warned > 1)}" if warned else "no problems"
    free, elastic = int(first.split()[-8]), int(first.split()[-4])
    assert code == 0 and free == elastic + 1  # the hinge
    assert first == f"c.toml: {verdict}; 2 bodies, 5 kg, {free} degrees of freedom, {elastic} of them elastic"
    assert others[-1] == "advice      c_advised.toml"
    assert read_case(tmp_path / "c_advised.toml").bodies.keys() == {"hub", "mast"}
    data = json.loads(femflex("check", "c.toml", "--json")[1])
    assert data["problems"] == [] and len(data["warnings"]) == warned and list(data["bodies"]) == ["mast"]
    assert data["bodies"]["mast"]["note"] in "\n".join(others)


def test_a_copy_with_the_advice_overwrites_no_other(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "c.v1.toml").write_text(HUB)
    monkeypatch.setattr(
        "femflex.pipeline.advised_case.advised_text", lambda case, decided: f"{case.path.name} {decided}"
    )
    copy = tmp_path / "c.v1_advised.toml"
    for force, decided in ((False, "first"), (True, "second")):
        assert check.advice_copy(tmp_path / "c.v1.toml", decided, force) == copy  # type: ignore[arg-type]
        assert copy.read_text() == f"c.v1.toml {decided}"
    with pytest.raises(FileExistsError, match=r"c\.v1_advised\.toml exists"):
        check.advice_copy(tmp_path / "c.v1.toml", "third", False)  # type: ignore[arg-type]


def test_warnings_of_a_check_are_counted(femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "c.toml").write_text(HUB)

    def examined(case: Path) -> tuple[Any, str]:
        for name, value in (("a", 2), ("b", 3)):
            warnings.warn(
                PhysicsWarning("{body_or_joint}: off by {value} %", body_or_joint=name, value=value), stacklevel=1
            )
        warnings.warn("other", PhysicsWarning, stacklevel=1)
        warnings.warn("of a library", UserWarning, stacklevel=1)
        warnings.warn("a cache", CacheWarning, stacklevel=1)
        return SimpleNamespace(notes={"hub": "a note"}, advice=[], system=SimpleNamespace(bodies={})), "one body"

    monkeypatch.setattr(check, "examine_case", examined)
    with warnings.catch_warnings():
        shown = warnings.showwarning
        code, out, err = femflex("check", "c.toml")
        assert code == 0 and out == "c.toml: no errors, 3 warnings; one body\nbody        hub: a note\n"
        texts = ["a: off by 2 % (likewise b, with its own numbers)", "other", "a cache"]
        assert err == "".join(f"femflex: warning: {text}\n" for text in texts)
        data = json.loads(femflex("check", "c.toml", "--json")[1])
        assert data == {"problems": [], "warnings": texts, "bodies": {}}
        warnings.showwarning = shown


def test_a_case_is_described_by_its_tables(femflex: Any, tmp_path: Path):
    (tmp_path / "c.toml").write_text(
        "[run]\norbits = 1.5\nintegrator = 'generalized_alpha'\n[orbit]\nkind = 'specified'\n"
        "semi_major_axis = '7000 km'\n"
        "[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\nmarkers.rim = { position = [1, 0, 0] }\n"
        "[bodies.arm]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"
        "[[joints]]\nkind = 'revolute'\nparent = 'hub'\nchild = 'arm'\naxis = [0, 0, 1]\n"
        "[[springs]]\nname = 's'\nparent = 'hub'\nparent_marker = 'rim'\nbody = 'arm'\nstiffness = 2\n"
        "[[loads]]\nname = 'push'\nbody = 'hub'\nmarker = 'rim'\nforce = [1, 0, 0]\n"
        "[expect.end]\nof = 'value'\nchannel = 'monitors/energy'\nabove = 0\n"
    )
    code, out, err = femflex("info", "c.toml")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "c.toml: case, without title",
        "run     1.5 orbits, integrator generalized_alpha",
        "orbit   specified",
        "body    hub: rigid",
        "body    arm: rigid",
        "joint   revolute from hub to arm",
        "spring  s from hub to arm",
        "load    push on hub.rim",
        "expects end",
    ]
    (tmp_path / "d.toml").write_text(
        "title = 'a hub'\n" + HUB + "[environment]\ngravity = [0, 0.5, -9.81]\n"
        "[[joints]]\nkind = 'free'\nchild = 'hub'\n[[springs]]\nname = 's'\nbody = 'hub'\nstiffness = 2\n"
        "[[constraints]]\nkind = 'knife_edge'\nname = 'blade'\nbody = 'hub'\nacross = [0, 1, 0]\n"
    )
    assert femflex("info", "d.toml")[1].splitlines() == [
        "d.toml: case, a hub",
        "run     4 s, integrator auto",
        "orbit   none",
        "gravity (0, 0.5, -9.81) m/s^2",
        "body    hub: rigid",
        "joint   free from the base frame to hub",
        "holds   knife_edge blade on hub.origin",
        "spring  s from the base frame to hub",
    ]


def test_a_body_file_is_described_with_shapes_markers_and_skin(tmp_path: Path):
    from test_whole_texts import two_masses

    body = two_masses(("static", "vibration"))
    # (2 (1, 0.5, -0.25) + 3 (-0.5, 2, 0.75)) / 5
    assert info.body_text(Path("x/wing.h5"), body).splitlines() == [
        "wing.h5: reduced body, 5 kg",
        "centre of mass (0.1, 1.4, 0.35) m",
        "shapes  1 static, 1 vibration",
        f"    1  {3 / (2 * np.pi):.6g} Hz",
        f"    2  {7 / (2 * np.pi):.6g} Hz",
        "marker  origin at (0, 0, 0) m",
        "marker  tip at (-0.5, 2, 0.75) m",
        "skin    2 points, 1 line",
    ]


def test_decks_are_described_and_those_that_are_none_say_why(femflex: Any, tmp_path: Path):
    from support.small_craft import BOOM

    (tmp_path / "a.inp").write_text(BOOM)
    code, out, _ = femflex("info", "a.inp")
    mesh, _, deck = out.partition("\n\n")
    assert code == 0 and mesh.startswith("a.inp: mesh\n")
    assert deck.startswith(
        "as a deck: a.inp cannot be used:\n  3 elements of type B31, the first is 1, have no section"
    )
    section = "*BEAM SECTION, ELSET=BOOM, MATERIAL=AL, SECTION=RECT\n0.1, 0.2\n0, 0, 1\n"
    material = "*MATERIAL, NAME=AL\n*ELASTIC\n7e10, 0.3\n*DENSITY\n2700\n"
    (tmp_path / "a.inp").write_text(BOOM + section + material)
    code, out, _ = femflex("info", "a.inp")
    deck, _, again = out.rstrip().rpartition("\n\n")
    assert code == 0 and again == mesh.rstrip() and "162 kg" in deck  # 2700 * 0.1 * 0.2 * 3


def test_a_file_that_is_not_there_or_a_folder_is_reported(
    femflex: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    assert femflex("info", "a.msh") == (2, "", "femflex: a.msh does not exist\n")
    assert femflex("info", "folder") == (2, "", "femflex: folder is a folder; name a file in it\n")


HDF5 = b"\x89HDF\r\n\x1a\n"


@pytest.mark.parametrize(
    ("name", "content", "reader"),
    [
        ("a.h5", HDF5, "_hdf5"), ("a.odd", HDF5, "_hdf5"), ("a.med", HDF5, "_mesh_or_deck"),
        ("a.toml", b"x", "_case"), ("a.op4", b"x", "_matrices"), ("a.MAT", b"x", "_matrices"),
        ("a.dat", b"x\nDMIG,K\n", "_matrices"), ("a.dat", b"x\nGRID,1\n", "_mesh_or_deck"),
        ("a.msh", b"x", "_mesh_or_deck"),
    ],
)  # fmt: skip
def test_files_are_described_by_what_they_hold(
    name: str, content: bytes, reader: str, femflex: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    (tmp_path / name).write_bytes(content)
    for each in ("_hdf5", "_case", "_matrices", "_mesh_or_deck"):
        monkeypatch.setattr(info, each, lambda *words, each=each: f"{each} of {' '.join(map(str, words))}")
    units = " mm-t-s" if reader == "_mesh_or_deck" else ""
    assert femflex("info", name, "--units", "mm-t-s") == (0, f"{reader} of {name}{units}\n", "")


def test_an_hdf5_file_of_no_format_holds_matrices_or_nothing(femflex: Any, monkeypatch: Any, tmp_path: Path):
    import h5py

    with h5py.File(tmp_path / "m.h5", "w") as file:
        file["M"] = np.eye(2)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["M"] = np.eye(2)
        file.attrs["format"] = "of another program"
    with h5py.File(tmp_path / "empty.h5", "w"):
        pass
    monkeypatch.setattr(info, "_matrices", lambda file: f"matrices of {file}")
    assert femflex("info", "m.h5") == (0, "matrices of m.h5\n", "")
    for name in ("other.h5", "empty.h5"):
        sentence = f"{name} is an HDF5 file, but neither a run nor a body of femflex, nor one of matrices"
        assert femflex("info", name) == (2, "", f"femflex: {sentence}\n")


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("a.bdf", "x\nDMIG,K\n", True),
        ("a.bdf", "x\ndmig,K\nCBAR,1\n", False),
        ("a.dat", "x\nDMIG,K\nctetra,1\n", False),
        ("a.nas", "x\nGRID,1\n", False),
        ("a.txt", "x\nDMIG,K\n", False),
    ],
)
def test_bulk_data_of_matrices_alone_are_matrices(name: str, text: str, found: bool, tmp_path: Path):
    (tmp_path / name).write_text(text)
    assert info._has_matrices(tmp_path / name) is found


@pytest.fixture
def stressed(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """A run of two bodies with strain and one without; keeps what the tables are made of."""
    field = SimpleNamespace(strain_field=("part",))
    bodies = {"wing": field, "hub": SimpleNamespace(strain_field=()), "fin": field}
    asked: list[Any] = []

    @contextmanager
    def opened(path: Path) -> Iterator[Any]:
        yield SimpleNamespace(bodies=lambda: bodies)

    def table(kind: str) -> Any:
        def make(run: Any, found: Any, names: list[str], *words: Any) -> list[list[Any]]:
            asked.append((kind, names, *words))
            return [["body", "largest"], ["wing", 2.5], ["fin", -1.25]]

        return make

    monkeypatch.setattr("femflex.results.open_run", opened)
    for name in ("_peaks", "_of_points", "_along_time"):
        monkeypatch.setattr(stress, name, table(name))
    monkeypatch.setattr(stress, "_wanted", lambda found, names, requested: requested)
    monkeypatch.setattr(stress, "_draw", lambda run, found, names, *words: asked.append(("draw", names, *words)))
    return asked


def test_stress_is_of_the_bodies_that_have_strain(femflex: Any, stressed: list[Any], tmp_path: Path):
    text = "body  largest\nwing      2.5\n fin    -1.25\n"
    assert femflex("stress", "r.h5") == (0, text, "")
    assert femflex("stress", "r.h5", "--points", "--quantity", "a", "--quantity", "b")[1] == text
    assert femflex("stress", "r.h5", "--body", "fin", "--at", "1,2,3", "--at", "0,-1,0.5")[1] == text
    assert stressed == [
        ("_peaks", ["wing", "fin"], None),
        ("_of_points", ["wing", "fin"], ["a", "b"]),
        ("_along_time", ["fin"], [[1.0, 2.0, 3.0], [0.0, -1.0, 0.5]], None),
    ]
    code, out, _ = femflex("stress", "r.h5", "--json")
    assert code == 0 and json.loads(out) == [{"body": "wing", "largest": 2.5}, {"body": "fin", "largest": -1.25}]
    stressed.clear()
    code, out, _ = femflex("stress", "r.h5", "-o", "s.csv", "-o", "s.png", "--force", "--quantity", "a")
    assert (code, out) == (0, text) and stressed[1] == ("draw", ["wing", "fin"], Path("s.png"), ["a"], True)
    table = "body,largest\nwing,2.5\nfin,-1.25\n"
    assert (tmp_path / "s.csv").read_text().replace("\r", "").replace("\n\n", "\n") == table
    for words in (["--points"], ["--at", "1,2,3"]):  # long tables go to the file alone
        assert femflex("stress", "r.h5", "-o", "s.csv", "--force", *words) == (0, "", "")
    for words, who in ((["hub"], "['hub']"), (["wing", "tail"], "['tail']")):
        options = [word for name in words for word in ("--body", name)]
        sentence = f"r.h5 has no strain of {who}; it has that of ['wing', 'fin']"
        assert femflex("stress", "r.h5", *options) == (2, "", f"femflex: {sentence}\n")
    code, _, err = femflex("stress", "r.h5", "--points", "--at", "1,2,3")
    assert (code, err) == (2, "femflex: --at and --points are two tables; give one of them\n")


def test_tables_of_stress_are_aligned_to_the_right():
    rows: list[list[Any]] = [["body", "largest", "time_s"], ["wing", 1.23456789e6, 0.5], ["b", -2.0, 12]]
    assert stress._table(rows).splitlines() == [
        "body     largest  time_s",
        "wing  1.2346e+06     0.5",
        "   b          -2      12",
    ]


def test_a_quantity_is_that_of_the_bodies_that_have_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("femflex.body.recovery.quantities", lambda parts: dict.fromkeys(parts, "N"))
    bodies = {name: SimpleNamespace(strain_field=own) for name, own in (("wing", "ab"), ("fin", "bc"), ("tail", "d"))}
    assert stress._wanted(bodies, ["wing", "fin"], None) == {"wing": ["a", "b"], "fin": ["b", "c"]}
    assert stress._wanted(bodies, ["wing", "fin"], ["c", "b"]) == {"wing": ["b"], "fin": ["c", "b"]}
    with pytest.raises(ValueError, match=r"no body of \['wing', 'fin'\] has the quantity 'd'; known are a, b, c"):
        stress._wanted(bodies, ["wing", "fin"], ["a", "d"])


# processes and signals


class Left(BaseException):
    """Stands for the end of the process."""


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Exit codes with which the process would have ended."""
    codes: list[int] = []

    def end(code: int) -> None:
        codes.append(code)
        raise Left

    monkeypatch.setattr(os, "_exit", end)
    monkeypatch.setattr(interrupt, "GRACE", 0.0)
    interrupt._unwinding.clear()
    yield codes  # type: ignore[misc]
    interrupt._unwinding.clear()


def test_leaving_takes_unfinished_files_along_and_shows_the_cursor(
    ends: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    parts = [tmp_path / "a.part", tmp_path / "b.part", tmp_path / "gone.part"]
    for part in parts[:2]:
        part.touch()
    monkeypatch.setattr(interrupts, "PARTS", set(parts))
    with pytest.raises(Left):
        interrupt.leave()
    assert ends == [130] and not list(tmp_path.iterdir()) and capsys.readouterr() == ("", "")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with pytest.raises(Left):
        interrupt._say_and_leave()
    assert ends == [130, 130] and capsys.readouterr().err == "femflex: interrupted\n\x1b[?25h"

    gone = SimpleNamespace(flush=raising(BrokenPipeError()))
    with monkeypatch.context() as patched, pytest.raises(Left):
        patched.setattr(sys, "stdout", gone)
        interrupt.leave()
    assert ends == [130, 130, 130]


def test_an_interrupt_ends_work_that_is_kept_and_leaves_otherwise(ends: list[int], capsys: Any):
    with interrupts.finished_on_interrupt("a movie"):
        with pytest.raises(KeyboardInterrupt):
            interrupt._asked(signal.SIGINT, None)
        assert not ends and interrupt._unwinding.is_set()
    interrupt._unwinding.clear()
    with pytest.raises(Left):
        interrupt._asked(signal.SIGINT, None)
    assert ends == [130] and capsys.readouterr().err == "femflex: interrupted\n"


@pytest.mark.parametrize(("kept", "unwinding"), [(False, False), (True, False), (False, True)])
def test_the_waiting_thread_leaves_where_nobody_ends_anything(kept: bool, unwinding: bool, ends: list[int]):
    reader, writer = socket.socketpair()
    writer.send(bytes([signal.SIGTERM, signal.SIGINT]))  # another signal first
    if unwinding:
        interrupt._unwinding.set()
    with reader, writer:
        if kept:
            with interrupts.finished_on_interrupt("a movie"):
                interrupt._wait(reader, writer)
        elif unwinding:
            interrupt._wait(reader, writer)
        else:
            with pytest.raises(Left):
                interrupt._wait(reader, writer)
    assert ends == ([] if kept or unwinding else [130])


@pytest.mark.parametrize(
    ("raised", "code"),
    [(None, 0), (SystemExit(2), 2), (SystemExit(130), "left"), (KeyboardInterrupt(), "left"), (SystemExit(None), None)],
)
def test_the_command_line_ends_with_the_code_of_its_verb(raised: Any, code: Any, monkeypatch: pytest.MonkeyPatch):
    from femflex.cli import app as module

    began = []
    monkeypatch.setattr(femflex.cli.interrupt, "answer_at_once", lambda: began.append(1))

    def leave() -> None:
        raise Left

    def app() -> None:
        if raised is not None:
            raise raised

    monkeypatch.setattr(femflex.cli.interrupt, "leave", leave)
    monkeypatch.setattr(module, "app", app)
    with pytest.raises(Left if code == "left" else SystemExit) as end:
        femflex.cli.main()
    assert began == [1] and (code == "left" or end.value.code == code)  # type: ignore[union-attr]


def test_a_working_folder_that_is_gone_ends_the_command(monkeypatch: pytest.MonkeyPatch, capsys: Any):
    monkeypatch.setattr(os, "getcwd", raising(FileNotFoundError()))
    with pytest.raises(SystemExit) as end:
        femflex.cli._check_folder()
    assert end.value.code == 2
    said = "femflex: the working folder does not exist any more; change to one that does\n"
    assert capsys.readouterr().err == said


def test_a_verb_ends_well_where_its_reader_has_left_or_it_is_interrupted(monkeypatch: Any, capsys: Any):
    error: list[BaseException] = [BrokenPipeError(), KeyboardInterrupt("kept until here"), KeyboardInterrupt()]
    sent: list[Any] = []
    monkeypatch.setattr(os, "dup2", lambda *words: sent.append(words))
    monkeypatch.setattr(os, "open", lambda *words: sent.append(words) or 77)
    monkeypatch.setattr(sys.stdout, "fileno", lambda: 1, raising=False)

    @verb("none")
    def failing() -> None:
        raise error.pop(0)

    with warnings.catch_warnings():
        shown = warnings.showwarning
        codes = []
        for _ in range(3):
            with pytest.raises(typer.Exit) as end:
                failing()
            codes.append(end.value.exit_code)
        warnings.showwarning = shown
    assert codes == [0, 130, 130] and sent == [(os.devnull, os.O_WRONLY), (77, 1)]
    assert capsys.readouterr().err == "femflex: kept until here\nfemflex: interrupted\n"


def test_a_traceback_is_shown_on_request(monkeypatch: pytest.MonkeyPatch):
    @verb("none")
    def failing() -> None:
        raise TypeError("odd")

    monkeypatch.setenv("FEMFLEX_TRACEBACK", "1")
    with warnings.catch_warnings():
        shown = warnings.showwarning
        with pytest.raises(TypeError, match="odd"):
            failing()
        warnings.showwarning = shown


def test_a_bar_that_is_kept_alive_repeats_its_last_value(monkeypatch: pytest.MonkeyPatch):
    from threading import Event

    from femflex.cli import keep_alive as module

    monkeypatch.setattr(module, "BEAT", 0.002)
    seen, often = [], Event()

    def bar(value: float) -> None:
        seen.append(value)
        if seen.count(0.75) > 3:
            often.set()

    with keep_alive(bar) as tell:
        tell(0.25)
        tell(0.75)
        assert often.wait(20)
    count = len(seen)
    assert seen[count - 1] == 0.75 and set(seen) <= {0.0, 0.25, 0.75}
    assert not Event().wait(0.02) and len(seen) == count


def test_a_bar_counts_from_its_start_to_an_end_that_may_move():
    bar, seen = Bar("integrating", 20.0, start=5.0, unit="s"), []
    bar._bar = SimpleNamespace(update=lambda task, **more: seen.append(more), stop=lambda: seen.append("stopped"))
    with bar:
        bar(7.1234567)
        bar(9.0, 30.0)
        bar(30.0)
    assert seen == [
        {"completed": pytest.approx(2.1234567), "total": 15.0, "text": "7.12346 of 20 s"},
        {"completed": 4.0, "total": 25.0, "text": "9 of 30 s"},
        {"completed": 25.0, "total": 25.0, "text": "30 of 30 s"},
        "stopped",
    ]


def test_a_bar_is_opened_after_two_seconds_on_a_terminal_alone(monkeypatch: pytest.MonkeyPatch):
    opened = []
    monkeypatch.setattr(
        Bar,
        "_open",
        lambda self: opened.append(self) or setattr(self, "_bar", SimpleNamespace(update=lambda task, **more: None)),
    )
    for watched, waited in ((True, 1.5), (False, 3.0), (True, 3.0)):
        monkeypatch.setattr("femflex.cli.progress.on_terminal", lambda watched=watched: watched)
        bar = Bar("integrating", 20.0)
        bar._began -= waited
        bar(5.0)
        assert len(opened) == (watched and waited > 2.0)


def test_an_interrupted_run_that_took_the_place_of_another_keeps_its_own_rows(monkeypatch: Any, tmp_path: Path):
    class Opened(list):
        time = np.array([0.0, 0.5, 1.25])

    @contextmanager
    def opened(path: Path) -> Iterator[Any]:
        yield Opened([1, 2, 3])

    monkeypatch.setattr("femflex.results.open_run", opened)
    path = tmp_path / "r.h5"
    path.write_text("rows")
    found = path.stat()
    for earlier in (None, (found.st_ino, found.st_size, found.st_mtime_ns - 1), (1, found.st_size, found.st_mtime_ns)):
        kept = run._what_is_kept(path, earlier)
        assert kept == f"interrupted; {path} keeps 3 rows, to 1.25 s, and --resume goes on from there"


def test_the_verb_of_terms_draws_keeps_and_prints_what_is_asked(femflex: Any, monkeypatch: Any, tmp_path: Path):
    from femflex.cli import terms

    (tmp_path / "r.h5").touch()
    asked: dict[str, Any] = {}
    found = SimpleNamespace(
        names=("a", "b"), units=("N", "N m"), own=("inertia/a", "inertia/b"), terms={"inertia": 1, "load": 2},
        parts={"inertia/a": 3}, time=[0.0, 4.0],
    )  # fmt: skip
    run = SimpleNamespace(time=np.array([0.5, 2.0, 4.5]), attributes={"advice": "[]"}, without=("K3",), path="r.h5")

    def keep(name: str, answer: Any = None) -> Any:
        return lambda *words, **more: asked.__setitem__(name, (words, more)) or answer

    @contextmanager
    def opened(path: Path) -> Iterator[Any]:
        yield run

    monkeypatch.setattr("femflex.results.open_run", opened)
    monkeypatch.setattr("femflex.pipeline.rebuilt", keep("rebuilt", "model"))
    monkeypatch.setattr("femflex.studies.explain.explain", keep("explain", found))
    monkeypatch.setattr("femflex.studies.explain.chosen", keep("chosen", [1]))
    monkeypatch.setattr("femflex.view.terms.plot_terms", keep("drawn"))
    monkeypatch.setattr(terms, "readable_part", keep("readable", (found, ", of which a part")))
    monkeypatch.setattr(terms, "print_term_tables", lambda *words: print("tables", *words[2]))
    monkeypatch.setattr(terms, "print_term_json", lambda *words: print("json", *words[2]))
    monkeypatch.setattr(terms, "keep_terms", keep("kept"))
    words = ["--coordinate", "b", "-o", "t.svg", "--case", "c.toml", "--theme", "dark", "--title", "mine", "--force"]
    code, out, _ = femflex("terms", "r.h5", *words, "--keep")
    assert code == 0 and out.splitlines() == [
        "tables 1", "picture     t.svg, of which a part", "kept        r.h5: terms/inertia, terms/load",
    ]  # fmt: skip
    assert asked["rebuilt"] == ((run, Path("c.toml")), {}) and asked["explain"] == ((run, "model", (0.5, 4.5)), {})
    assert asked["chosen"] == ((found, ["b"]), {}) and asked["readable"] == ((found, [1]), {"wanted": True})
    (drawn, time, parts, (one,), path, theme, title), more = asked["drawn"]
    assert (drawn, time, parts, path, theme, title) == (run, found.time, found.parts, Path("t.svg"), "dark", "mine")
    assert (one.index, one.name, one.unit, one.own) == (1, "b", "N m", "inertia/b") and more == {"force": True}
    assert asked["kept"][0][:2] == (Path("r.h5"), found) and asked["kept"][0][2].path == Path("r.h5")
    code, out, _ = femflex("terms", "r.h5", "--from", "1", "--to", "0.05 min", "-o", "u.svg", "--whole", "--json")
    assert (code, out) == (0, "json 1\n") and asked["explain"][0][2] == (1.0, 3.0)
    assert asked["readable"][1] == {"wanted": False} and asked["chosen"][0][1] == []
    assert asked["drawn"][0][2] == found.terms and asked["drawn"][0][3][0].own == "inertia"
    assert femflex("terms", "r.h5", "--keep", "--json")[1] == "json 1\n"
    for word in ("--from", "--to"):
        sentence = "--keep keeps the terms of the whole run; leave out --from and --to"
        assert femflex("terms", "r.h5", "--keep", word, "1") == (2, "", f"femflex: {sentence}\n")


def test_warnings_wait_and_are_each_printed_once(capsys: pytest.CaptureFixture[str]):
    groups = warning_output.WarningGroups()
    for text in ("b", "a", "b"):
        groups.add(PhysicsWarning(text))
    groups.print_pending()
    groups.add(PhysicsWarning("a"))
    groups.add(PhysicsWarning("c"))
    groups.print_pending()
    groups.print_pending()
    assert capsys.readouterr().err == "".join(f"femflex: warning: {text}\n" for text in "bac")
    assert groups.texts == ["b", "a", "c"]
