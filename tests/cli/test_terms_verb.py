"""`femflex terms`, `run --without` and `plot --with`: what they print, write, and answer to mistakes."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.cli.app import app
from femflex.results import add_channels, open_run
from femflex.system import Channel


def told(*words):
    """Exit code, standard output and standard error of a command."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("terms")


@pytest.fixture
def full(folder, craft, write_case):
    """A run of the hub with a boom, its case and mesh in the same folder."""
    path = folder / "full.h5"
    if not path.exists():
        made = write_case()
        for name in ("craft.toml", "boom.inp"):
            shutil.copy(made.with_name(name), folder / name)
        code, _, wrong = told("run", folder / "craft.toml", "-o", path, "--no-pictures")
        assert code == 0, wrong
    return path


@pytest.fixture
def calm(folder, full):
    """The same without the push and the boom's damping."""
    path = folder / "calm.h5"
    if not path.exists():
        code, said, wrong = told("run", folder / "craft.toml", "-o", path, "--without", "push, damping")
        assert code == 0, wrong
        assert "without loads/push, damping" in said
    return path


def test_the_table_names_every_term_and_says_how_well_they_balance(full):
    code, said, _ = told("terms", full)
    assert code == 0
    for word in (
        "base-hub.omega_z, N m",
        "boom.delta1_rate, kg^1/2 m/s^2",
        "loads/push",
        "inertia/boom",
        "elastic",
        "damping",
    ):
        assert word in said
    with open_run(full) as run:
        assert f"of the largest, over {len(run)} instants" in said and "the terms sum to zero to" in said


def test_json_says_the_same_in_numbers(full):
    code, said, _ = told(
        "terms", full, "--coordinate", "base-hub.omega_z", "--coordinate", "boom.delta1", "--to", 1.9, "--json"
    )
    data = json.loads(said)
    assert code == 0 and data["without"] == [] and data["remainder"] < 1e-10
    assert set(data["coordinates"]) == {"base-hub.omega_z", "boom.delta1_rate"}
    push = data["coordinates"]["base-hub.omega_z"]["terms"]["loads/push"]
    assert push["peak"] == pytest.approx(-1.0) and push["rms"] == pytest.approx(1.0)  # 1 N m until 2 s


def test_the_largest_term_comes_first_and_inertia_is_followed_by_its_parts(full):
    words = ("terms", full, "--coordinate", "boom.delta1")
    sizes = json.loads(told(*words, "--json")[1])["coordinates"]["boom.delta1_rate"]["terms"]
    rows = [line for line in told(*words)[1].splitlines() if line.split() and line.split()[0] in sizes]
    names = [line.split()[0] for line in rows]
    assert "inertia" in names and "elastic" in names
    parts = [name for name in names if name.startswith("inertia/")]
    assert parts and names[names.index("inertia") + 1 :][: len(parts)] == parts
    for falling in (parts, [name for name in names if name not in parts]):
        rms = [sizes[name]["rms"] for name in falling]
        assert rms == sorted(rms, reverse=True)
    largest = max(sizes[name]["rms"] for name in names if name not in parts)
    for line, name in zip(rows, names, strict=True):
        assert float(line.split()[-1].rstrip("%")) == pytest.approx(100 * sizes[name]["rms"] / largest, abs=0.06)


@pytest.mark.slow
def test_the_picture_is_written_once(full, tmp_path):
    code, said, _ = told("terms", full, "-o", tmp_path / "a.svg", "--theme", "dark", "--whole", "--coordinate", "all")
    assert code == 0 and "picture" in said and (tmp_path / "a.svg").stat().st_size > 10_000
    code, _, wrong = told("terms", full, "-o", tmp_path / "a.svg")
    assert code == 2 and "a.svg" in wrong


@pytest.mark.slow
def test_a_run_says_what_was_switched_off_in_it(full, calm):
    with h5py.File(calm) as file:
        assert file.attrs["without"] == "loads/push, damping"
    with open_run(full) as all_on, open_run(calm) as off:
        assert all_on.without == () and off.without == ("loads/push", "damping")
        rate, calmer = all_on["bodies/hub/rate"], off["bodies/hub/rate"]
        assert np.abs(rate - calmer).max() > 1e-3
        assert np.ptp(off["monitors/energy"]) < 1e-7 * off["monitors/energy"][0]
    assert "without loads/push, damping" in told("info", calm)[1]
    code, said, _ = told("terms", calm)
    assert code == 0 and "without loads/push, damping" in said and "loads/push " not in said
    assert "sum to zero" in said


@pytest.mark.slow
def test_two_runs_are_laid_over_each_other(full, calm, tmp_path):
    code, said, wrong = told("plot", full, "bodies/hub/rate", "--with", calm, "-o", tmp_path / "both.png")
    assert code == 0, wrong
    assert (tmp_path / "both.png").stat().st_size > 10_000 and "both.png" in said
    assert told("plot", full, "--spectrum", "--with", calm, "-o", tmp_path / "spectra.png")[0] == 0
    code, _, wrong = told("plot", full, "--with", tmp_path / "none.h5", "-o", tmp_path / "c.png")
    assert code == 2 and "none.h5 does not exist" in wrong


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--coordinate", "boom.delta9"], "'boom.delta9' is not a coordinate of the run; near it are ['boom.delta"),
        (["--from", "20"], "there are 0 instants from 20 to 10 s; the run has them from 0 to 10 s"),
        (["--case", "/nowhere/craft.toml"], "was made from /nowhere/craft.toml, and that folder is not here"),
        (["-o", "picture.pdf"], "a plot is written as .png or .svg; picture.pdf is neither"),
        (["--theme", "pink", "-o", "picture.png"], "theme 'pink' is not known"),
    ],
)
def test_mistakes_are_answered_in_a_sentence(full, words, sentence):
    code, _, wrong = told("terms", full, *words)
    assert code == 2 and sentence in wrong and "Traceback" not in wrong


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (
            "gravity",
            "'gravity' cannot be switched off: this system has none. Known here are coriolis_centrifugal, elastic, "
            "damping, loads/push, flexibility, flexibility/boom.",
        ),
        ("gravity_gradient", "'gravity_gradient' cannot be switched off: this system has none."),
        ("inertia", "without it there is no motion to solve for"),
    ],
)
def test_a_name_that_cannot_be_switched_off_is_answered_and_nothing_is_written(folder, full, names, sentence):
    code, _, wrong = told("run", folder / "craft.toml", "-o", folder / "no.h5", "--without", names)
    assert code == 2 and sentence in wrong and not (folder / "no.h5").exists()


def test_meshes_that_changed_or_went_away_are_noticed(folder, full, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    there = Path(shutil.copy(folder / "craft.toml", elsewhere))
    code, _, wrong = told("terms", full, "--case", there)
    assert code == 2 and "boom.inp" in wrong
    (elsewhere / "boom.inp").write_text((folder / "boom.inp").read_text().replace("4, 3.0", "4, 3.5"))
    code, _, wrong = told("terms", full, "--case", there)
    assert code == 2
    assert f"{full} was made with other inputs: the contents of boom.inp (bodies.boom.mesh) have changed. Undo" in wrong


def test_an_unfinished_run_is_resumed_with_the_same_things_switched_off(folder, calm, tmp_path):
    shutil.copy(calm, tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file.attrs["complete"] = False
    code, _, wrong = told("run", folder / "craft.toml", "-o", tmp_path / "run.h5", "--resume")
    assert code == 2 and "was begun with loads/push, damping switched off, not nothing; resume it likewise" in wrong
    names = "push,coriolis_centrifugal"  # as many, of which one is another
    code, _, wrong = told("run", folder / "craft.toml", "-o", tmp_path / "run.h5", "--resume", "--without", names)
    assert code == 2 and "with loads/push, damping switched off, not loads/push, coriolis_centrifugal;" in wrong


def test_a_run_without_case_text_has_no_terms(full, tmp_path):
    shutil.copy(full, tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file.attrs["case_text"] = ""
    code, _, wrong = told("terms", tmp_path / "run.h5")
    assert code == 2 and "keeps no case text, so its model cannot be built again" in wrong


def test_terms_are_kept_in_the_run_and_can_be_plotted(full, tmp_path):
    kept = tmp_path / "run.h5"
    shutil.copy(full, kept)
    for _ in range(2):  # the second time they are replaced
        code, said, wrong = told("terms", kept, "--keep", "--case", full.with_name("craft.toml"))
        assert code == 0, wrong
        assert "terms/inertia" in said
    with open_run(kept) as run, open_run(full) as before:
        terms = {path: run[path] for path in run if path.startswith("terms/")}
        assert {"terms/inertia", "terms/loads/push", "terms/elastic"} <= set(terms)
        assert run.names("terms/elastic") == run.names("u") and run.units("terms/loads/push")[5] == "N m"
        assert np.abs(sum(terms.values())).max() < 1e-10 * max(np.abs(rows).max() for rows in terms.values())
        assert run.complete and all(np.array_equal(run[path], before[path]) for path in before)
    assert told("plot", kept, "terms/loads/push:base-hub.omega_z", "-o", tmp_path / "push.png")[0] == 0
    code, _, wrong = told("terms", kept, "--keep", "--to", 5)
    assert code == 2 and "--keep keeps the terms of the whole run" in wrong


def test_channels_of_another_length_are_refused(full):
    with pytest.raises(ValueError, match=r"channel 'terms/x' has shape \(3,\); this run needs \("):
        add_channels(full, {"terms/x": (Channel("N", "none"), np.zeros(3))})
