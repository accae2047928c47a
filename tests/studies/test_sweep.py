"""Sweeps: designs, closed forms, failing members, interrupts and resumed sweeps, frequencies of the craft."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.stats import norm
from support.small_cases import clamped_rod, sprung_wheels
from typer.testing import CliRunner

from femflex.case.read import parse_case
from femflex.case.sweep import parse_sweep
from femflex.cli.app import app
from femflex.cli.verb import meaning
from femflex.studies import plan_study
from femflex.studies.study import Study
from femflex.studies.sweep import open_sweep, sweep
from femflex.studies.sweep.member import member_values, run_member, sobol_indices_of, unit_samples
from femflex.studies.sweep.sweep import journal_of, plan_sweep

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
histories = ["bodies/wheel/rate:z", "monitors/energy"]

[vary."bodies.wheel.inertia.2"]
between = ["1 kg m^2", "3 kg m^2"]

[vary."loads.motor.torque.2"]
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


def test_every_member_matches_its_closed_form(study, tmp_path):
    progress_values = []
    results = sweep(study(), tmp_path / "s.h5", workers=1, progress=progress_values.append)
    speed = results.inputs["loads.motor.torque.2"] * 2.0 / results.inputs["bodies.wheel.inertia.2"]
    assert results.outputs["speed"] == pytest.approx(speed, rel=1e-9)
    assert progress_values == [1, 2, 3, 4, 5, 6] and not any(results.problems)
    assert results.units == {
        "bodies.wheel.inertia.2": "kg m^2",
        "loads.motor.torque.2": "",
        "speed": "rad/s",
        "bodies/wheel/rate:z": "rad/s",
        "monitors/energy": "J",
    }
    mean, sigma, least, largest = results.statistics()["speed"]
    assert (mean, sigma) == pytest.approx((speed.mean(), speed.std(ddof=1)))
    assert (least, largest) == (speed.argmin(), speed.argmax())
    assert results.output_percentiles()["speed"] == pytest.approx(np.percentile(speed, [5, 50, 95]), rel=1e-9)
    assert results.histories["bodies/wheel/rate:z"] == pytest.approx(np.outer(speed, results.time / 2.0), rel=1e-9)
    stored = open_sweep(tmp_path / "s.h5")
    assert np.array_equal(stored.outputs["speed"], results.outputs["speed"]) and stored.units == results.units
    with h5py.File(tmp_path / "s.h5") as file:
        assert "percentiles_of_histories/bodies|wheel|rate:z" in file
    assert not journal_of(tmp_path / "s.h5").exists()


def test_interrupted_sweep_resumes_to_the_same_bits(study, tmp_path):
    uninterrupted = sweep(study(), tmp_path / "whole.h5", workers=1)

    def interrupt_after_three(count):
        if count == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(study(), tmp_path / "s.h5", workers=1, progress=interrupt_after_three)
    journal = journal_of(tmp_path / "s.h5")
    with journal.open("a") as file:
        file.write('{"number": 3, "outp')  # a line cut short
    progress_values = []
    resumed = sweep(study(), tmp_path / "s.h5", workers=1, resume=True, progress=progress_values.append)
    assert progress_values == [4, 5, 6] and np.array_equal(resumed.outputs["speed"], uninterrupted.outputs["speed"])
    assert np.array_equal(
        sweep(study(), tmp_path / "s.h5", resume=True).outputs["speed"], uninterrupted.outputs["speed"]
    )
    with pytest.raises(KeyboardInterrupt):
        sweep(study(), tmp_path / "t.h5", workers=1, progress=interrupt_after_three)
    with pytest.raises(ValueError, match="journal"):
        sweep(study(("seed = 4", "seed = 5")), tmp_path / "t.h5", workers=1, resume=True)
    with pytest.raises(ValueError, match="another sweep"):
        sweep(study(("seed = 4", "seed = 5")), tmp_path / "s.h5", workers=1, resume=True)


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGINT")
def test_interrupted_sweep_names_resume_command(study, tmp_path):
    path = study(("members = 6", "members = 2000"))
    command = [sys.executable, "-m", "femflex", "sweep", path.name, "-o", "s.h5", "--workers", "1"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        while not journal_of(tmp_path / "s.h5").exists() and process.poll() is None:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130 and "femflex sweep study.toml -o s.h5 --resume" in err


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file size")
@pytest.mark.parametrize("room, kept", [(1500, "(2)"), (5000, "(6)")])  # bytes: for the journal, for the results
def test_full_disk_keeps_the_members_that_are_done(study, tmp_path, room, kept):
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        with pytest.raises(OSError) as refused:
            sweep(study(), tmp_path / "s.h5", workers=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    code, (sentence,) = meaning(refused.value)
    assert code == 3 and all(part in sentence for part in ("s.h5", kept, "--resume"))
    journal = journal_of(tmp_path / "s.h5")
    assert journal.read_text().endswith("}\n") and not (tmp_path / "s.h5").exists()
    assert not any(sweep(study(), tmp_path / "s.h5", workers=1, resume=True).problems)


def test_sweep_is_not_resumed_when_a_mesh_has_changed(craft, write_case, tmp_path):
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
def test_two_workers_give_the_same_bits(study, tmp_path):
    results_of_one = sweep(study(), tmp_path / "one.h5", workers=1)
    results_of_two = sweep(study(), tmp_path / "two.h5", workers=2)
    assert np.array_equal(results_of_one.outputs["speed"], results_of_two.outputs["speed"])
    assert np.array_equal(
        results_of_one.histories["bodies/wheel/rate:z"], results_of_two.histories["bodies/wheel/rate:z"]
    )


def test_failed_members_are_listed_with_their_problem(study, tmp_path):
    inertia = '"bodies.wheel.inertia.2"]\nbetween = ["1 kg m^2", "3 kg m^2"]'
    grid = study(
        ('"latin_hypercube"\nmembers = 6', '"grid"'),
        (inertia, '"bodies.wheel.mass"]\nvalues = ["3 kg", "-1 kg"]'),
        ("normal = [4, 0.5]", "values = [2, 4]"),
    )
    results = sweep(grid, tmp_path / "s.h5", workers=1)
    assert [bool(text) for text in results.problems] == [False, False, True, True]
    assert "bodies.wheel.mass" in results.problems[2] and np.isnan(results.outputs["speed"][2:]).all()
    assert results.outputs["speed"][:2] == pytest.approx([2.0, 4.0], rel=1e-9)


@pytest.mark.parametrize("design", ["random", "latin_hypercube", "sobol"])
def test_designs_have_their_distribution_and_repeat_by_their_seed(design):
    text = f'case = "c.toml"\ndesign = "{design}"\nmembers = 512\nseed = 7\nhistories = ["q:1"]\n'
    text += '[vary.a]\nbetween = [1, 3]\n[vary.b]\nnormal = ["10 m", "2 m"]\n'
    table = parse_sweep(text)
    rows = member_values(table)
    assert rows == member_values(table) and rows != member_values(parse_sweep(text.replace("seed = 7", "seed = 8")))
    a, b = np.array([row["a"] for row in rows]), np.array([float(row["b"].split()[0]) for row in rows])
    assert 1 <= a.min() and a.max() <= 3 and rows[0]["b"].endswith(" m")
    assert [a.mean(), b.mean(), b.std()] == pytest.approx([2.0, 10.0, 2.0], rel=0.1)
    assert np.abs(np.sort(norm.cdf(b, 10, 2)) - (np.arange(512) + 0.5) / 512).max() < 0.1
    assert unit_samples(table).shape == (512, 2)


def test_verb_writes_results_and_pictures(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study()
    run = CliRunner().invoke
    result = run(app, ["sweep", "study.toml", "--workers", "1", "-o", "s.h5", "-o", "s.png"])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "s.png").stat().st_size > 10_000
    result = run(app, ["sweep", "study.toml", "-o", "s.h5", "-o", "e.png", "--envelope", "--resume", "--json"])
    assert json.loads(result.stdout)["runs"] == 6 and (tmp_path / "e.png").stat().st_size > 10_000


def test_sobol_indices_of_a_product(study, tmp_path):
    """Speed = 2 torque / inertia: for independent factors X Y the variances follow from those of X and 1 / Y."""
    path = study(('"latin_hypercube"\nmembers = 6', '"sobol_indices"\nmembers = 64'))
    table = parse_sweep(path.read_text())
    rows = member_values(table)
    assert len(rows) == 64 * 4
    inertia, torque = (np.array([float(str(row[key]).split()[0]) for row in rows]) for key in table.vary)
    indices = sobol_indices_of(table, 2.0 * torque / inertia)
    mean = np.log(3.0) / 2.0  # of 1 / J, J uniform from 1 to 3
    v_inv, v_torque = (1 - 1 / 3.0) / 2.0 - mean**2, 0.5**2
    variance = (v_inv + mean**2) * (v_torque + 16.0) - mean**2 * 16.0
    first_order = np.array([16.0 * v_inv, mean**2 * v_torque]) / variance
    assert indices[:, 0] == pytest.approx(first_order, abs=0.05) and indices[:, 1] == pytest.approx(
        1 - first_order[::-1], abs=0.05
    )
    failed_indices = sobol_indices_of(table, np.where(np.arange(len(rows)) == 3, np.nan, torque))
    assert np.isnan(failed_indices).all()
    assert member_values(table) == member_values(table)


DISPERSION = Path(__file__).parents[2] / "cases" / "studies" / "panel_dispersion.toml"


@pytest.mark.slow
def test_members_of_the_shipped_dispersion_have_the_momentum_of_their_pulses():
    """Each pulse changes from one torque to the other along 5 s: what is left is 2.5 s times the two departures."""
    table, plan = plan_sweep(DISPERSION)
    for number, values in list(enumerate(member_values(table)))[:2]:
        outcome = run_member(plan, number, values)
        assert not outcome.problem
        first_departure, last_departure = values["loads.0.torque.0.1"] - 40.0, values["loads.0.torque.3.1"] + 40.0
        remaining_momentum = dict(zip(table.outputs, outcome.outputs, strict=True))["left"]
        assert remaining_momentum == pytest.approx(2.5 * (first_departure + last_departure), abs=1e-6)


DESIGN = """
case = "c.toml"
{head}
[vary."a.mass"]
{first}
[vary."b.size"]
{second}
[outputs.speed]
channel = "bodies/a/rate"
component = "z"
"""


def table(head: str, first_range: str, second_range: str):
    return parse_sweep(DESIGN.format(head=head, first=first_range, second=second_range))


WHEELS = sprung_wheels(48, 'samples = 5\n[attitude]\nframe = "inertial"')
FREQUENCY_STUDY = '[study]\nquantity = { of = "system_frequency", mode = 3 }\n'
ROD = clamped_rod('{ y = 2, family = "polynomial" }') + FREQUENCY_STUDY
CLAMPED = 1.8751040687119611**2 / 4 * np.sqrt(3000.0 / 0.5) / (2 * np.pi)


def test_system_frequency_by_mode_and_by_branch():
    """Above the two wheels, at 1 / pi and 6.93 / 2 pi Hz, lies the bending of the clamped rod."""
    level_set = plan_study(parse_case(WHEELS + ROD), "modes", [1, 2]).level_set

    def study(quantity: str) -> Study:
        return Study(parse_case(WHEELS + ROD.replace("mode = 3", quantity)), "modes", level_set)

    built = level_set.levels[1].build()
    wheels = np.sqrt([8 / 2, 48 / 3]) / (2 * np.pi)
    for quantity, hertz, tolerance in (
        ("mode = 2", wheels[1], 1e-6),
        ('branch = "joint 1"', wheels[0], 1e-6),
        ('branch = "joint 2"', wheels[1], 1e-6),
        ('branch = "joint 1", mode = 2', wheels[0], 1e-6),
        ("mode = 3", CLAMPED, 5e-3),
    ):
        assert study(quantity).value(built, print) == (pytest.approx(hertz, rel=tolerance), "Hz", 0.0)
    points = list(study("mode = 4").points())  # with one function the craft has three modes, with two it has four
    assert [bool(point.problem) for point in points] == [True, False] and np.isnan(points[0].value)
    assert points[1].unit == "Hz" and points[1].value > CLAMPED and (points[1].level, points[1].count) == (2, 2)
