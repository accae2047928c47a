"""`femflex run`: answers with closed forms, exit codes, output files, resuming."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.image import imread
from support.small_craft import BOOM, CRAFT

import femflex as package
from femflex.results import open_run

CASES = Path(__file__).parents[2] / "cases"

WHEEL = """
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

[expect.speed]
of = "value"
channel = "bodies/wheel/rate"
component = "z"
value = {expected}
relative_tolerance = 1e-9
source = "T t / J"
"""


@pytest.mark.parametrize(("expected", "code"), [(4.0, 0), (5.0, 0)], ids=["holds", "does not hold"])
def test_run_of_wheel_under_constant_torque_has_closed_form(femflex, tmp_path, expected, code):
    (tmp_path / "wheel.toml").write_text(WHEEL.format(expected=expected))
    done = femflex("run", "wheel.toml")
    assert done[0] == code and ("does not hold" in done[1]) == (expected == 5.0), done
    with open_run(tmp_path / "wheel.h5") as run:
        assert run.complete
        np.testing.assert_allclose(run["bodies/wheel/rate"][:, 2], 2 * run.time, atol=1e-9)
        np.testing.assert_allclose(run["q"][:, 0], run.time**2, atol=1e-9)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["wheel.h5", "wheel.toml"]


def test_existing_output_is_only_replaced_with_force(femflex, tmp_path):
    (tmp_path / "wheel.toml").write_text(WHEEL.format(expected=4) + "[pictures]\nplots = ['bodies/wheel/rate']\n")
    for name in ("wheel.h5", "wheel_bodies_wheel_rate.png"):
        (tmp_path / name).write_text("mine")
        code, out, err = femflex("run", "wheel.toml")
        assert (code, out) == (2, "") and name in err and "--force" in err
        assert (tmp_path / name).read_text() == "mine"
        (tmp_path / name).unlink()
    assert femflex("run", "wheel.toml")[0] == 0
    first_result = (tmp_path / "wheel.h5").read_bytes()
    assert femflex("run", "wheel.toml", "--resume")[0] == 0  # complete: nothing to do
    assert (tmp_path / "wheel.h5").read_bytes() == first_result
    assert femflex("run", "wheel.toml", "--force")[0] == 0
    assert imread(tmp_path / "wheel_bodies_wheel_rate.png").std() > 0.01


def test_motion_that_diverges_exits_with_3_and_keeps_rows(femflex, craft, write_case, tmp_path):
    """A heavy hub spins faster than the boom's lowest frequency: with linear strain the boom diverges exponentially."""
    text = craft.replace('"2 deg/s", 0, 0.01', '0, 0, "100 rad/s"').replace("[120, 100, 140]", "[1e9, 1e9, 1e9]")
    text = text.replace("[bodies.boom]", '[bodies.boom]\nstrain = "linear"')
    code, _, err = femflex("run", write_case(text.replace("mass = 200", "mass = 1e7")), "-o", "run.h5")
    assert code == 3 and "boom.delta" in err and "Traceback" not in err
    with open_run(tmp_path / "run.h5") as run:
        assert not run.complete and "diverges" in run.ended
        assert 0 < len(run) < 201 and np.isfinite(run["q"]).all()


def test_overflow_exits_with_3_and_keeps_finite_rows(femflex, craft, write_case, tmp_path):
    text = craft.replace(
        "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "torque = [[0, 1e30, 0], [0, 1e30, 0]]\ntimes = [5, 20]"
    )
    code, _, err = femflex("run", write_case(text), "-o", "run.h5")
    assert code == 3 and "t = 5 s" in err
    with open_run(tmp_path / "run.h5") as run:
        assert not run.complete and run.time[-1] == 5.0 and np.isfinite(run["q"]).all()


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file size")
def test_full_disk_exits_with_3_and_leaves_no_part(femflex, write_case, tmp_path):
    import resource

    case = write_case()
    names_before = sorted(path.name for path in tmp_path.iterdir())
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        code, _, err = femflex("run", case, "-o", "run.h5")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert code == 3 and "run.h5" in err and "too large" in err and "Traceback" not in err
    assert sorted(path.name for path in tmp_path.iterdir()) == names_before


def rows_of(path):
    """Number of rows that a result file has so far; 0 while it cannot be read."""
    try:
        with h5py.File(path) as file:
            return int(file["progress"][0])
    except (OSError, KeyError, IndexError):
        return 0


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGINT")
def test_interrupted_run_resumes_bit_for_bit(femflex, craft, write_case, tmp_path, monkeypatch):
    case = write_case(craft.replace("output_step = 0.05", "output_step = 0.005\nmax_step = 0.0001"))
    output = tmp_path / "run.h5"
    command = [sys.executable, "-m", "femflex", "run", str(case), "-o", str(output)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        while not (output.exists() and rows_of(output)) and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        err = process.communicate(timeout=60)[1]
    assert process.returncode == 130 and "--resume" in err
    with h5py.File(output) as file:
        assert not file.attrs["complete"] and file.attrs["ended"] == b"interrupted"
        rows = int(file["progress"][0])
        assert 0 < rows < 2001 and str(rows) in err and np.isfinite(file["q"][:rows]).all()
    assert femflex("run", case, "-o", output, "--resume")[0] == 0
    assert femflex("run", case, "-o", "whole.h5")[0] == 0
    with open_run(output) as resumed, open_run(tmp_path / "whole.h5") as complete_run:
        assert resumed.complete and len(resumed) == 2001
        for path in ("q", "u", "markers/boom.tip/position", "monitors/energy"):
            np.testing.assert_array_equal(resumed[path], complete_run[path])


# resuming with another case

SHORT = CRAFT.replace('duration = "10 s"', 'duration = "1 s"').replace(
    "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", 'table = "push.csv"'
)


@pytest.fixture(scope="module")
def short_run(tmp_path_factory) -> Path:
    """Folder of a complete run of 1 s and its case."""
    folder = tmp_path_factory.mktemp("short")
    for name, text in (("boom.inp", BOOM), ("push.csv", "time [s],tz [N m]\n0,1\n2,1\n"), ("craft.toml", SHORT)):
        (folder / name).write_text(text)
    package.run(folder / "craft.toml", folder / "run.h5").close()
    return folder


@pytest.fixture
def unfinished(short_run, tmp_path, femflex) -> Path:
    """The working folder with a copy of it, its run marked as unfinished."""
    shutil.copytree(short_run, tmp_path, dirs_exist_ok=True)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file.attrs["complete"] = False
    return tmp_path


def edit(path: Path, old: str, new: str) -> None:
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("boom.inp", "3.0, 0.0", "3.2, 0.0", ("boom.inp", "bodies.boom.mesh")),
        ("push.csv", "2,1", "2,1.05", ("push.csv", "loads[0].table")),
        ("craft.toml", "mass = 200", "mass = 250", ("bodies.hub.mass", "200", "250")),
        ("craft.toml", 'damping = { ratio = "0.5 %" }', "", ("bodies.boom.damping",)),
        ("craft.toml", "output_step = 0.05", "output_step = 0.05\nrtol = 1e-9", ("run.rtol",)),
        ("craft.toml", '"1 s"', '"0.5 s"', ("1 s", "0.5 s")),
        ("craft.toml", "output_step = 0.05", "output_step = 0.1", ("0.05 s", "0.1 s")),
    ],
)
def test_resume_with_changed_input_is_refused(femflex, unfinished, name, old, new, words):
    contents = (unfinished / "run.h5").read_bytes()
    edit(unfinished / name, old, new)
    code, out, err = femflex("run", "craft.toml", "-o", "run.h5", "--resume")
    assert (code, out) == (2, "") and all(word in err for word in ("run.h5", *words)), err
    assert (unfinished / "run.h5").read_bytes() == contents


def test_resume_permits_changes_outside_the_motion(femflex, unfinished):
    edit(unfinished / "craft.toml", "hub with a boom", "another title")
    edit(unfinished / "craft.toml", "[run]", '[expect.x]\nof = "drift"\nchannel = "monitors/energy"\nbelow = 9\n[run]')
    with (unfinished / "craft.toml").open("a") as file:
        file.write("# a remark\n[pictures]\npicture = false\n")
    (unfinished / "boom.inp").write_text("** a remark\n" + BOOM)
    assert femflex("run", "craft.toml", "-o", "run.h5", "--resume")[0] == 0


def test_resume_with_later_end_agrees_with_longer_run(femflex, unfinished):
    edit(unfinished / "craft.toml", '"1 s"', '"2.02 s"')
    assert femflex("run", "craft.toml", "-o", "whole.h5")[0] == 0
    assert femflex("run", "craft.toml", "-o", "run.h5", "--resume")[0] == 0
    with open_run(unfinished / "run.h5") as run, open_run(unfinished / "whole.h5") as long_run:
        assert run.complete and np.array_equal(run.time, long_run.time) and len(run) == 42
        for path in ("q", "u", "markers/boom.tip/position", "monitors/energy"):
            assert np.abs(run[path] - long_run[path]).max() < 1e-9 * np.abs(long_run[path]).max()  # steps to 1e-11
    edit(unfinished / "craft.toml", '"2.02 s"', '"3 s"')  # 2.02 s is no multiple of the output step
    assert femflex("run", "craft.toml", "-o", "run.h5", "--resume")[0] == 0
    with open_run(unfinished / "run.h5") as run:
        assert run.time[40:44] == pytest.approx([2.0, 2.02, 2.05, 2.1]) and run.time[-1] == 3.0


# runs without a term


def test_run_without_load_and_damping_conserves_energy(femflex, unfinished):
    words = ("run", "craft.toml", "-o", "calm.h5")
    assert femflex(*words, "--without", "push, damping")[0] == 0
    with open_run(unfinished / "calm.h5") as calm, open_run(unfinished / "run.h5") as full:
        assert calm.without == ("loads/push", "damping") and full.without == ()
        assert np.ptp(calm["monitors/energy"]) < 1e-7 * calm["monitors/energy"][0]
        assert np.ptp(full["monitors/energy"]) > 1e-3 * full["monitors/energy"][0]
    assert femflex("plot", "run.h5", "bodies/hub/rate", "--with", "calm.h5", "-o", "both.svg")[0] == 0
    with h5py.File("calm.h5", "r+") as file:
        file.attrs["complete"] = False
    for names in ((), ("--without", "push,coriolis_centrifugal")):
        code, _, err = femflex(*words, "--resume", *names)
        assert code == 2 and "loads/push, damping" in err


@pytest.mark.slow
def test_linear_strain_diverges_in_second_run_of_spin_up(femflex, tmp_path):
    """Kane's beam with two bending coordinates, past the time at which linear strain diverges, no scene drawn."""
    text = (CASES / "spin_up.toml").read_text().partition("[study]")[0]
    for old, new in (
        ('"20 s"', '"14 s"'),
        ("= 1001", "= 141"),
        ("y = 6, axial = 3", "y = 2"),
        ('times = ["6.76 s"]\n', ""),
    ):
        assert old in text, old
        text = text.replace(old, new)
    shutil.copy(CASES / "spin_up.csv", tmp_path)
    (tmp_path / "case.toml").write_text(text)
    code, _, err = femflex("run", "case.toml", "-o", "run.h5")
    assert code == 0, err
    with open_run(tmp_path / "run.h5") as nonlinear_run, open_run(tmp_path / "run_without.h5") as linear_run:
        assert linear_run.without == ("nonlinear_strain",) and not linear_run.complete and nonlinear_run.complete
        nonlinear_tip, linear_tip = (run["markers/beam.tip/deflection"][:, 1] for run in (nonlinear_run, linear_run))
        assert 9.0 < linear_run.time[-1] < 12.0 and np.abs(linear_tip).max() > 100 * np.abs(nonlinear_tip).max()
        np.testing.assert_allclose(linear_tip[:30], nonlinear_tip[:30], atol=0.02)  # at first they agree
    assert np.ptp(imread(tmp_path / "run_markers_beam.tip_deflection.png")) > 0.5
