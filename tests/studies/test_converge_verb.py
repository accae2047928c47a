"""`femflex converge` on the command line: what it prints, draws, keeps and refuses."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.cli import keep_alive
from femflex.cli.app import app
from femflex.integrate import IntegrationError, Steps
from femflex.studies import study

MODE = (
    'of = "value", channel = "markers/beam.tip/deflection", component = "y"',
    'of = "mode_frequency", body = "beam"',
)
Called = Callable[..., tuple[int, str, str]]


@pytest.fixture
def converge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Called:
    """Runs `femflex converge` in a folder of its own; returns exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> tuple[int, str, str]:
        done = CliRunner().invoke(app, ["converge", *map(str, arguments)])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        return done.exit_code, done.stdout, done.stderr

    return call


def rows(out: str) -> list[list[str]]:
    """Cells of the lines that begin with a number."""
    return [line.split() for line in out.splitlines() if line.lstrip(" ")[:1].isdigit() and not line.startswith("  ")]


def test_it_explains_itself_with_an_example(converge: Called):
    code, out, _ = converge("--help")
    assert code == 0 and "Example: femflex converge cases/orbiter_beam.toml" in " ".join(out.split())


def test_it_prints_a_table_and_a_verdict(converge: Called, written: Callable[..., Path]):
    code, out, err = converge(written(), "--levels", "2,3,4,6,8,10", "--tolerance", "1e-3")
    assert (code, err) == (0, "")
    assert "\nvalue of markers/beam.tip/deflection y at the end [m]" in out
    assert [row[0] for row in rows(out)] == ["2", "3", "4", "6", "8", "10"]
    assert [row[0] for row in rows(out) if row[-1] == "<-"] == ["6"]
    told = " ".join(out.split())
    assert "Converged to 0.001: 6 modes suffice" in told and "Errors fall like n^-" in told
    assert "The case keeps 4, which is not enough" in told


@pytest.mark.slow
def test_it_prints_the_order_over_the_mesh_and_draws(converge: Called, written: Callable[..., Path]):
    code, out, err = converge(written(MODE, cells=2), "--over", "mesh", "--levels", "0 1 2 3", "-o", "study.svg")
    assert (code, err) == (0, "")
    assert [row[:2] for row in rows(out)] == [
        ["0", "28"],
        ["1", "50"],
        ["2", "94"],
        ["3", "182"],
    ]  # 11 an element and 6 at an end
    assert "with order 3.9" in out and "picture     study.svg" in out
    assert "order 3.9" in Path("study.svg").read_text()


@pytest.mark.slow
def test_json_is_the_whole_study(converge: Called, written: Callable[..., Path]):
    code, out, _ = converge(written(MODE, cells=2), "--over", "mesh", "--levels", "0,1,2", "--json", "-o", "study.png")
    found = json.loads(out)
    assert code == 0 and Path("study.png").exists()
    assert found["quantity"] == "frequency of mode 1 of beam" and found["unit"] == "Hz"
    assert found["levels"] == [0, 1, 2] and found["counts"] == [28, 50, 94]
    assert found["changes"][0] is None and len(found["values"]) == len(found["errors"]) == 3
    assert found["order"] == pytest.approx(4, abs=0.15) and found["scatter"] is None
    assert found["recommended"] == 0 and found["complete"] and found["verdict"].startswith("Converged")


@pytest.fixture
def stopped(monkeypatch: pytest.MonkeyPatch) -> Callable[[int, BaseException], None]:
    """Makes the run after so many levels end with an exception."""

    def stop(after: int, error: BaseException) -> None:
        whole, count = study.watched, iter(range(100))

        def watched(*arguments: object) -> np.ndarray:
            if next(count) >= after:
                raise error
            return whole(*arguments)  # type: ignore[arg-type]

        monkeypatch.setattr(study, "watched", watched)

    return stop


def test_an_interrupt_keeps_the_levels_there_are(converge: Called, written: Callable[..., Path], stopped):
    stopped(4, KeyboardInterrupt())
    code, out, err = converge(written(), "--levels", "2,3,4,6,8,10", "-o", "study.png")
    assert code == 130
    assert [row[0] for row in rows(out)] == ["2", "3", "4", "6"] and "verdict" in out
    assert err == "femflex: broken off after 4 of 6 levels\nfemflex: no picture is drawn\nfemflex: interrupted\n"
    assert not Path("study.png").exists()


def test_an_interrupt_before_the_first_value_leaves_nothing(converge: Called, written: Callable[..., Path], stopped):
    stopped(0, KeyboardInterrupt())
    assert converge(written(), "--json") == (130, "", "femflex: interrupted\n")


def test_numerics_that_fail_keep_the_levels_there_are(converge: Called, written: Callable[..., Path], stopped):
    steps = Steps(1, 0, 1, 0.1, 0.1, "failed")
    stopped(2, IntegrationError("the motion is not finite", np.zeros(1), np.zeros((1, 2)), 0, steps))
    code, out, err = converge(written(), "--levels", "2,3,4", "--json")
    found = json.loads(out)
    assert (code, found["levels"], found["complete"]) == (3, [2, 3], False)
    assert found["verdict"].startswith("Two levels differ by")
    assert err.endswith("femflex: the numerics failed: the motion is not finite\n")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--levels", "1,x"], "--levels is '1,x'; give whole numbers with commas, such as 1,2,4,8"),
        (["--levels", "3"], "found levels 3; give at least two different numbers of modes"),
        (["--over", "time"], "a study varies modes, mesh, derivatives, segments, functions or strain; found 'time'"),
        (["--tolerance", "0"], "--tolerance is 0; give a relative error between 0 and 1"),
        (["-o", "study.pdf"], "a plot is written as .png or .svg; study.pdf is neither"),
        (["-o", "there.png"], "there.png exists"),
        (["-o", "study.png", "--theme", "blue"], "theme 'blue' is not known"),
        (["--levels", "2,300"], "bodies.beam: 300 modes were requested, but only"),
    ],
)
def test_bad_input_is_a_sentence_and_writes_nothing(
    converge: Called, written: Callable[..., Path], arguments: list[str], told: str
):
    case = written()
    Path("there.png").write_bytes(b"")
    before = sorted(Path.cwd().iterdir())
    code, out, err = converge(case, *arguments)
    assert (code, out) == (2, "") and told in err and "Traceback" not in err
    assert sorted(Path.cwd().iterdir()) == before


def test_levels_left_out_are_said(converge: Called, written: Callable[..., Path]):
    third = (MODE[0], MODE[1] + ", mode = 3")
    _, out, _ = converge(written(third), "--levels", "2,3,4")
    assert "left out    2: mode 3 of body 'beam' has no natural frequency" in out
    assert [row[0] for row in rows(out)] == ["3", "4"]


def test_progress_is_told_again_while_a_level_takes_long(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(keep_alive, "BEAT", 0.01)
    told: list[float] = []
    with keep_alive.keep_alive(told.append) as tell:
        tell(30.0)
        time.sleep(0.1)
    count = len(told)
    assert count > 3 and told[0] in (0.0, 30.0) and told[-1] == 30.0
    time.sleep(0.03)
    assert len(told) == count
