"""`run --resume`: only with the inputs that began the run; its end, its pictures and what is expected may change."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from support.small_craft import BOOM, CRAFT
from typer.testing import CliRunner

import femflex
from femflex.case import read_case
from femflex.cli.app import app
from femflex.results import open_run

SHORT = CRAFT.replace('duration = "10 s"', 'duration = "1 s"').replace(
    "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", 'table = "push.csv"'
)
TABLE = "time [s],tz [N m]\n0,1\n2,1\n"
CUT = 12  # rows that an unfinished run has


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Folder of a complete run and its case."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "boom.inp").write_text(BOOM)
    (folder / "push.csv").write_text(TABLE)
    (folder / "craft.toml").write_text(SHORT)
    assert told("run", folder / "craft.toml", "-o", folder / "run.h5")[0] == 0
    return folder


@pytest.fixture
def folder(done, tmp_path):
    """A copy of it, its run marked as unfinished."""
    for name in ("boom.inp", "push.csv", "craft.toml", "run.h5"):
        shutil.copy(done / name, tmp_path)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file.attrs["complete"] = False
    return tmp_path


def told(*words: object) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stdout, done.stderr


def resumed(folder: Path) -> tuple[int, str, str]:
    return told("run", folder / "craft.toml", "-o", folder / "run.h5", "--resume")


def edit(path: Path, old: str, new: str) -> None:
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


REFUSED = [
    ("boom.inp", "3.0, 0.0", "3.2, 0.0", "the contents of boom.inp (bodies.boom.mesh) have changed"),
    ("push.csv", "2,1", "2,1.05", "the contents of push.csv (loads[0].table) have changed"),
    ("craft.toml", "mass = 200", "mass = 250", "bodies.hub.mass was 200, now 250"),
    ("craft.toml", 'damping = { ratio = "0.5 %" }', "", "bodies.boom.damping is no longer there"),
    ("craft.toml", '"70 GPa"', '"70.1 GPa"', "materials.aluminium.E was 7e+10, now 7.01e+10"),
    ("craft.toml", "output_step = 0.05", "output_step = 0.05\nrtol = 1e-9", "run.rtol is new"),
]


@pytest.mark.parametrize("complete", [False, True], ids=["unfinished", "complete"])
@pytest.mark.parametrize(("name", "old", "new", "sentence"), REFUSED)
def test_changed_inputs_are_refused_by_name(folder, name, old, new, sentence, complete):
    with h5py.File(folder / "run.h5", "r+") as file:
        file.attrs["complete"] = complete
    before = (folder / "run.h5").read_bytes()
    edit(folder / name, old, new)
    code, out, err = resumed(folder)
    assert (code, out) == (2, "")
    assert err == (
        f"femflex: {folder / 'run.h5'} was begun with another case: {sentence}. Undo the change to resume it, or start "
        f"anew without --resume\n"
    )
    assert (folder / "run.h5").read_bytes() == before


def test_other_versions_and_files_without_digests_are_refused(folder, monkeypatch):
    monkeypatch.setattr(femflex, "__version__", "9.9")
    code, _, err = resumed(folder)
    assert code == 2 and "was begun with femflex 0.2.0, and this is 9.9; resume it with that version" in err
    with h5py.File(folder / "run.h5", "r+") as file:
        del file.attrs["inputs"]
    code, _, err = resumed(folder)
    assert code == 2 and "does not hold digests of the inputs of its run" in err and "run it anew" in err


def test_what_is_not_integrated_may_change(folder):
    edit(folder / "craft.toml", "hub with a boom", "another title")
    edit(folder / "craft.toml", "[run]", '[expect.x]\nof = "drift"\nchannel = "monitors/energy"\nbelow = 9\n[run]')
    (folder / "craft.toml").write_text(
        (folder / "craft.toml").read_text() + "# a remark\n[pictures]\npicture = false\n"
    )
    (folder / "boom.inp").write_text("** a remark\n" + BOOM)
    code, _, err = resumed(folder)
    assert (code, err) == (0, "")


@pytest.mark.sampled(1)
@pytest.mark.parametrize("complete", [False, True], ids=["unfinished", "complete"])
def test_a_later_end_continues_to_the_answer_of_the_longer_run(folder, complete):
    with h5py.File(folder / "run.h5", "r+") as file:
        file.attrs["complete"] = complete
    edit(folder / "craft.toml", '"1 s"', '"2.02 s"')
    assert told("run", folder / "craft.toml", "-o", folder / "whole.h5")[0] == 0
    assert resumed(folder)[0] == 0
    with open_run(folder / "run.h5") as run, open_run(folder / "whole.h5") as whole:
        assert run.complete and np.array_equal(run.time, whole.time) and len(run) == 42
        for path in ("q", "u", "markers/boom.tip/position", "monitors/energy"):
            size = np.abs(whole[path]).max()
            assert np.abs(run[path] - whole[path]).max() < 1e-9 * size  # tolerance 1e-11 of a step
    edit(folder / "craft.toml", '"2.02 s"', '"3 s"')  # 2.02 s is no multiple of the output step
    assert resumed(folder)[0] == 0
    with open_run(folder / "run.h5") as run:
        assert run.time[40:44] == pytest.approx([2.0, 2.02, 2.05, 2.1]) and run.time[-1] == 3.0


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('"1 s"', '"0.5 s"', "run.h5 holds rows up to 1 s, and the case now ends at 0.5 s; give a later end"),
        ("output_step = 0.05", "output_step = 0.1", "holds a row at 0.05 s where the case now has one at 0.1 s"),
        ('"1 s"\noutput_step = 0.05', '"2 s"\nsamples = 21', "at 0.05 s where the case now has one at 0.1 s"),
    ],
)
def test_an_earlier_end_and_other_output_times_are_refused(folder, old, new, sentence):
    edit(folder / "craft.toml", old, new)
    code, out, err = resumed(folder)
    assert code == 2 and out == "" and sentence in err


def test_a_case_changed_in_python_is_not_resumed(folder):
    case = read_case(folder / "craft.toml")
    other = case.model_copy(update={"attitude": case.attitude.model_copy(update={"rates": (0.0, 0.0, 0.02)})})
    with pytest.raises(ValueError, match=r"attitude\.rates\[0\] was 0\.0349\d*, now 0"):
        femflex.run(other, folder / "run.h5", resume=True)
    with femflex.run(case, folder / "run.h5", resume=True) as run:
        assert run.complete
