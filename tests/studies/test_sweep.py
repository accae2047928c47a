"""Sweeps: designs, failing members, resumption, percentiles, pictures, and mistakes in their files."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from femflex.case import CaseError, with_values
from femflex.case.read import parse_case
from femflex.case.sweep import parse_sweep
from femflex.cli.app import app
from femflex.studies.sweep import open_sweep, sweep
from femflex.studies.sweep.design import designed, indices, unit_samples
from femflex.studies.sweep.journal import add, begin, journal_of, read_journal
from femflex.studies.sweep.member import run_member
from femflex.studies.sweep.sweep import planned

SPUN = """
title = "a wheel that is spun up"

[run]
duration = "2 s"
samples = 11

[bodies.wheel]
kind = "rigid"
mass = "3 kg"
inertia = [2, 2, 2]

[[joints]]
kind = "revolute"
child = "wheel"
name = "axle"

[[loads]]
name = "motor"
body = "wheel"
torque = [0, 0, "4 N m"]
"""
STUDY = """
case = "spun.toml"
design = "latin_hypercube"
members = 6
seed = 4
histories = ["bodies/wheel/rate:z"]

[vary."bodies.wheel.inertia.2"]
between = ["1 kg m^2", "3 kg m^2"]

[vary."loads.0.torque.2"]
normal = [4, 0.5]

[outputs.speed]
of = "value"
channel = "bodies/wheel/rate"
component = "z"
"""


@pytest.fixture
def study(tmp_path):
    """Writes the sweep with some of its text replaced."""
    (tmp_path / "spun.toml").write_text(SPUN)

    def write(*replaced: tuple[str, str]) -> Path:
        text = STUDY
        for old, new in replaced:
            assert old in text, old
            text = text.replace(old, new)
        (tmp_path / "study.toml").write_text(text)
        return tmp_path / "study.toml"

    return write


def test_every_member_is_the_closed_form_of_its_values(study, tmp_path):
    seen = []
    found = sweep(study(), tmp_path / "s.h5", workers=1, progress=seen.append)
    speed = found.inputs["loads.0.torque.2"] * 2.0 / found.inputs["bodies.wheel.inertia.2"]
    assert found.outputs["speed"] == pytest.approx(speed, rel=1e-9)
    assert seen == [1, 2, 3, 4, 5, 6] and not any(found.problems)
    assert found.units == {
        "bodies.wheel.inertia.2": "kg m^2",
        "loads.0.torque.2": "",
        "speed": "rad/s",
        "bodies/wheel/rate:z": "rad/s",
    }
    assert found.of_outputs()["speed"] == pytest.approx(np.percentile(speed, [5, 50, 95]), rel=1e-9)
    assert found.histories["bodies/wheel/rate:z"] == pytest.approx(np.outer(speed, found.time / 2.0), rel=1e-9)
    read = open_sweep(tmp_path / "s.h5")
    assert np.array_equal(read.outputs["speed"], found.outputs["speed"]) and read.units == found.units
    with h5py.File(tmp_path / "s.h5") as file:
        assert "percentiles_of_histories/bodies|wheel|rate:z" in file
    assert not journal_of(tmp_path / "s.h5").exists()


def test_a_sweep_that_was_killed_goes_on_to_the_same_bits(study, tmp_path):
    whole = sweep(study(), tmp_path / "whole.h5", workers=1)

    def killed(count):
        if count == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(study(), tmp_path / "s.h5", workers=1, progress=killed)
    journal = journal_of(tmp_path / "s.h5")
    with journal.open("a") as file:
        file.write('{"number": 3, "outp')  # a line cut short
    seen = []
    again = sweep(study(), tmp_path / "s.h5", workers=1, resume=True, progress=seen.append)
    assert seen == [4, 5, 6] and np.array_equal(again.outputs["speed"], whole.outputs["speed"])
    assert np.array_equal(sweep(study(), tmp_path / "s.h5", resume=True).outputs["speed"], whole.outputs["speed"])
    with pytest.raises(KeyboardInterrupt):
        sweep(study(), tmp_path / "t.h5", workers=1, progress=killed)
    with pytest.raises(ValueError, match=r"t\.h5\.journal is of another sweep"):
        sweep(study(("seed = 4", "seed = 5")), tmp_path / "t.h5", workers=1, resume=True)
    with pytest.raises(ValueError, match=r"s\.h5 is of another sweep: the file of the sweep, its case or a file that"):
        sweep(study(("seed = 4", "seed = 5")), tmp_path / "s.h5", workers=1, resume=True)


def test_a_journal_is_whole_before_the_first_member_is_done(study, tmp_path):
    """A sweep that is killed at once, or while it goes on, keeps its digest and what was done."""
    _, plan = planned(study())
    one = run_member(plan, 0, designed(planned(study())[0])[0])
    with begin(tmp_path / "s.journal", plan, []):
        assert read_journal(tmp_path / "s.journal", plan) == []
    with begin(tmp_path / "s.journal", plan, [one]):
        assert read_journal(tmp_path / "s.journal", plan) == [one]
    assert [path.name for path in tmp_path.glob("s.*")] == ["s.journal"]
    with begin(tmp_path / "s.journal", plan, [one]) as file:
        file.write('{"number": 7, "val\n')  # cut short; the sweep went on after it
    with (tmp_path / "s.journal").open("a") as file:
        add(file, replace(one, number=2))
    assert read_journal(tmp_path / "s.journal", plan) == [one, replace(one, number=2)]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs signals")
def test_workers_end_with_the_sweep_that_began_them(study, tmp_path):
    code = (
        "import os, sys\nfrom femflex.studies.sweep.workers import _pool\n"
        "if __name__ == '__main__':\n    pool = _pool(2)\n"
        "    print(*{pool.submit(os.getpid).result() for _ in range(8)}, flush=True)\n    sys.stdin.read()\n"
    )
    script = tmp_path / "pool.py"
    script.write_text(code)
    parent = subprocess.Popen([sys.executable, script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None and parent.stdin is not None
    workers = [int(word) for word in parent.stdout.readline().split()]
    assert workers
    parent.kill()
    parent.wait()
    until = time.monotonic() + 60.0
    while time.monotonic() < until and any(_lives(pid) for pid in workers):
        time.sleep(0.05)
    parent.stdout.close()
    parent.stdin.close()
    assert not any(_lives(pid) for pid in workers)


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_sweep_is_another_one_when_a_file_of_its_case_has_changed(craft, write_case, tmp_path):
    case = write_case(craft.replace('duration = "10 s"', 'duration = "0.1 s"'))
    study = case.with_name("study.toml")
    study.write_text(
        'case = "craft.toml"\ndesign = "grid"\n[vary."bodies.hub.mass"]\nvalues = [200, 210]\n'
        '[outputs.x]\nof = "peak"\nchannel = "markers/boom.tip/deflection"\ncomponent = "y"\n'
    )
    sweep(study, tmp_path / "s.h5", workers=1)
    mesh = case.with_name("boom.inp")
    mesh.write_text(mesh.read_text().replace("4, 3.0, 0.0, 0.0", "4, 3.5, 0.0, 0.0"))
    with pytest.raises(ValueError, match="is of another sweep"):
        sweep(study, tmp_path / "s.h5", workers=1, resume=True)


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_bits(study, tmp_path):
    one = sweep(study(), tmp_path / "one.h5", workers=1)
    two = sweep(study(), tmp_path / "two.h5", workers=2)
    assert np.array_equal(one.outputs["speed"], two.outputs["speed"])
    assert np.array_equal(one.histories["bodies/wheel/rate:z"], two.histories["bodies/wheel/rate:z"])


@pytest.mark.parametrize("workers", [3, None])
def test_members_go_to_as_many_workers_as_requested_or_as_there_are_cores(study, tmp_path, monkeypatch, workers):
    module = sys.modules[sweep.__module__]

    asked, done = [], []

    def here(plan, todo, count, scheduler):
        asked.append((count, scheduler, [number for number, _ in todo]))
        yield from (run_member(plan, number, values) for number, values in reversed(todo))

    monkeypatch.setattr(module, "outcomes", here)
    monkeypatch.setattr(module, "usable_cores", lambda: 7)
    found = sweep(study(("members = 6", "members = 2")), tmp_path / "s.h5", workers=workers, progress=done.append)
    assert asked == [(workers or 7, None, [0, 1])] and done == [1.0, 2.0]
    rates = found.outputs["speed"] * found.inputs["bodies.wheel.inertia.2"] / found.inputs["loads.0.torque.2"]
    assert rates == pytest.approx([2.0, 2.0], rel=1e-6) and found.units["bodies/wheel/rate:z"] == "rad/s"


def test_members_that_differ_in_numbers_lower_each_body_once_and_compile_nothing(study, monkeypatch):
    """Counts, not times: a body whose numbers stay is lowered for the first member alone, and no kernel is compiled."""
    from femflex.dynamics.lowering import bodies as lowering
    from femflex.dynamics.motion import equations

    table, plan = planned(study(("bodies.wheel.inertia.2", "joints.0.damping"), ('"1 kg m^2", "3 kg m^2"', "0, 1")))
    members, lowered = designed(table), []
    numbers = lowering._numbers
    monkeypatch.setattr(lowering, "_numbers", lambda body: (lowered.append(body), numbers(body))[1])
    counts, compiled = [], []
    for k, values in enumerate(members):
        assert not run_member(plan, k, values).problem
        counts.append(len(lowered))
        compiled.append(len(getattr(equations.rate, "signatures", ())))
    assert counts[0] <= 2 and len(set(counts)) == 1 and len(set(compiled)) == 1  # one more where the case is decided


def test_a_member_that_fails_is_kept_with_its_problem(study, tmp_path):
    inertia = '"bodies.wheel.inertia.2"]\nbetween = ["1 kg m^2", "3 kg m^2"]'
    grid = study(
        ('"latin_hypercube"\nmembers = 6', '"grid"'),
        (inertia, '"bodies.wheel.mass"]\nvalues = ["3 kg", "-1 kg"]'),
        ("normal = [4, 0.5]", "values = [2, 4]"),
    )
    found = sweep(grid, tmp_path / "s.h5", workers=1)
    assert [bool(text) for text in found.problems] == [False, False, True, True]
    assert "bodies.wheel.mass" in found.problems[2] and np.isnan(found.outputs["speed"][2:]).all()
    assert found.outputs["speed"][:2] == pytest.approx([2.0, 4.0], rel=1e-9)
    none = grid.read_text().replace('["3 kg", "-1 kg"]', '["-1 kg"]')
    grid.write_text(none)
    with pytest.raises(ValueError, match="every member of the sweep failed; the first: "):
        sweep(grid, tmp_path / "t.h5", workers=1)


def test_a_failed_member_is_reported_by_the_row_that_holds_no_numbers(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    inertia = '"bodies.wheel.inertia.2"]\nbetween = ["1 kg m^2", "3 kg m^2"]'
    study(
        ('"latin_hypercube"\nmembers = 6', '"grid"'),
        (inertia, '"bodies.wheel.mass"]\nvalues = ["3 kg", "-1 kg", "2 kg"]'),
        ("normal = [4, 0.5]", "values = [6]"),
    )
    found = CliRunner().invoke(app, ["sweep", "study.toml", "--workers", "1", "-o", "s.h5", "--json"])
    data = json.loads(found.stdout)
    assert found.exit_code == 0 and data["runs"] == 3
    (failed,) = data["failed"]
    empty = [k for k, value in enumerate(data["outputs"]["speed"]) if value is None]
    assert [failed["run"]] == empty and data["inputs"]["bodies.wheel.mass"][failed["run"]] == -1.0
    assert "bodies.wheel.mass" in failed["problem"] and f"run {empty[0]} failed: " in found.stderr
    with h5py.File(tmp_path / "s.h5") as file:
        assert bool(file["problems"][empty[0]])


@pytest.mark.parametrize("design", ["random", "latin_hypercube", "sobol"])
def test_scatters_have_their_distribution_and_repeat_by_their_seed(design):
    text = f'case = "c.toml"\ndesign = "{design}"\nmembers = 512\nseed = 7\nhistories = ["q:1"]\n'
    text += '[vary.a]\nbetween = [1, 3]\n[vary.b]\nnormal = ["10 m", "2 m"]\n'
    table = parse_sweep(text)
    rows = designed(table)
    assert rows == designed(table) and rows != designed(parse_sweep(text.replace("seed = 7", "seed = 8")))
    a, b = np.array([row["a"] for row in rows]), np.array([float(row["b"].split()[0]) for row in rows])
    assert 1 <= a.min() and a.max() <= 3 and rows[0]["b"].endswith(" m")
    assert [a.mean(), b.mean(), b.std()] == pytest.approx([2.0, 10.0, 2.0], rel=0.1)
    assert np.abs(np.sort(norm.cdf(b, 10, 2)) - (np.arange(512) + 0.5) / 512).max() < 0.1
    assert unit_samples(table).shape == (512, 2)


def test_the_verb_prints_percentiles_and_draws(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study()
    run = CliRunner().invoke
    found = run(app, ["sweep", "study.toml", "--workers", "1", "-o", "s.h5", "-o", "s.png"])
    assert found.exit_code == 0 and "6, of which 0 failed" in found.output, found.output
    assert (tmp_path / "s.png").stat().st_size > 10_000
    found = run(app, ["sweep", "study.toml", "-o", "s.h5", "-o", "e.png", "--envelope", "--resume", "--json"])
    assert json.loads(found.stdout)["runs"] == 6 and (tmp_path / "e.png").stat().st_size > 10_000
    found = run(app, ["sweep", "study.toml", "-o", "s.h5"])
    assert found.exit_code == 2 and "--force" in found.output
    try:
        import distributed  # noqa: F401
    except ImportError:
        found = run(app, ["sweep", "study.toml", "-o", "d.h5", "--scheduler", "tcp://nowhere:1"])
        assert found.exit_code == 2 and "a sweep on a cluster needs Dask" in " ".join(found.output.split())


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("members = 6", "", "design = 'latin_hypercube' without members"),
        ("between =", "values =", "needs between or normal for 'bodies.wheel.inertia.2'"),
        ('"3 kg m^2"', '"3 kg"', "in two units"),
        ('"1 kg m^2", "3', '"4 kg m^2", "3', "the second must be above the first"),
        ("[4, 0.5]", "[4, 0]", "the standard deviation must be above 0"),
        ("seed", "sead", "did you mean 'seed'?"),
        ("bodies.wheel.inertia.2", "bodies.weel.inertia.2", "bodies has no 'weel'; did you mean 'wheel'?"),
        ("bodies.wheel.inertia.2", "bodies.wheel.inertja", "inertja: this key is not known; did you mean 'inertia'?"),
        ("spun.toml", "spin.toml", "there is no such case file"),
    ],
)
def test_mistakes_in_the_file_are_answered(study, tmp_path, old, new, sentence):
    with pytest.raises(CaseError) as caught:
        sweep(study((old, new)), tmp_path / "s.h5", workers=1)
    assert sentence in str(caught.value)


def test_a_file_that_is_no_sweep_is_refused(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["a"] = 1.0
    with h5py.File(tmp_path / "chart.h5", "w") as file:
        file["percentiles"] = [5.0]
    for name in ("x.h5", "chart.h5"):
        with pytest.raises(ValueError, match=rf"{name} does not hold a sweep; `femflex sweep` writes one"):
            open_sweep(tmp_path / name)
    with pytest.raises(CaseError, match="there is no such file"):
        sweep(tmp_path / "none.toml", tmp_path / "s.h5")


@pytest.mark.parametrize("text", ["case = 3", "case = "])
def test_mistakes_in_a_sweep_name_its_file(text):
    with pytest.raises(CaseError, match=r"wide\.toml"):
        parse_sweep(text, "wide.toml")


def test_sobol_indices_of_a_product_are_its_closed_form(study, tmp_path):
    """Speed = 2 torque / inertia: for independent factors X Y the variances follow from those of X and 1 / Y."""
    path = study(('"latin_hypercube"\nmembers = 6', '"sobol_indices"\nmembers = 64'))
    table = parse_sweep(path.read_text())
    rows = designed(table)
    assert len(rows) == 64 * 4
    inertia, torque = (np.array([float(str(row[key]).split()[0]) for row in rows]) for key in table.vary)
    found = indices(table, 2.0 * torque / inertia)
    mean = np.log(3.0) / 2.0  # of 1 / J, J uniform from 1 to 3
    v_inv, v_torque = (1 - 1 / 3.0) / 2.0 - mean**2, 0.5**2
    whole = (v_inv + mean**2) * (v_torque + 16.0) - mean**2 * 16.0
    first = np.array([16.0 * v_inv, mean**2 * v_torque]) / whole
    assert found[:, 0] == pytest.approx(first, abs=0.05) and found[:, 1] == pytest.approx(1 - first[::-1], abs=0.05)
    again = indices(table, np.where(np.arange(len(rows)) == 3, np.nan, torque))
    assert np.isnan(again).all()
    assert designed(table) == designed(table)


def test_a_sweep_for_sobol_indices_keeps_prints_and_draws_them(study, tmp_path):
    path = study(('"latin_hypercube"\nmembers = 6', '"sobol_indices"\nmembers = 4'))
    words = [
        "sweep",
        str(path),
        "-o",
        str(tmp_path / "s.h5"),
        "-o",
        str(tmp_path / "s.png"),
        "--indices",
        "--workers",
        "1",
    ]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.stderr
    assert "share in the variance of speed" in done.stdout and "runs        16" in done.stdout
    assert open_sweep(tmp_path / "s.h5").sobol["speed"].shape == (2, 2) and (tmp_path / "s.png").stat().st_size > 5000
    with pytest.raises(CaseError, match="found members = 6; design = 'sobol_indices' needs a power of 2, such as 64"):
        parse_sweep(path.read_text().replace("members = 4", "members = 6"))


DISPERSION = Path(__file__).parents[2] / "cases" / "studies" / "panel_dispersion.toml"


def test_the_shipped_dispersion_names_keys_of_its_case():
    table, plan = planned(DISPERSION)
    members = designed(table)
    assert len(members) == 500
    changed = with_values(parse_case(plan.case_text, Path(plan.case_path)), members[0])
    assert changed.bodies["hub"].mass != 400.0


@pytest.mark.slow
def test_members_of_the_shipped_dispersion_keep_the_momentum_of_their_pulses():
    """Each pulse changes from one torque to the other along 5 s: what is left is 2.5 s times the two departures."""
    table, plan = planned(DISPERSION)
    for number, values in list(enumerate(designed(table)))[:2]:
        found = run_member(plan, number, values)
        assert not found.problem
        first, last = values["loads.0.torque.0.1"] - 40.0, values["loads.0.torque.3.1"] + 40.0
        left = dict(zip(table.outputs, found.outputs, strict=True))["left"]
        assert left == pytest.approx(2.5 * (first + last), abs=1e-6)
