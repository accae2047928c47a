"""`femflex linearize`: what it prints and writes, and its answers to mistakes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.small_craft import BOOM, CRAFT
from typer.testing import CliRunner

from femflex.cli.app import app


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("craft")
    (path / "boom.inp").write_text(BOOM)
    (path / "craft.toml").write_text(CRAFT)
    return path


@pytest.fixture
def femflex(folder, monkeypatch):
    monkeypatch.chdir(folder)
    runner = CliRunner()
    return lambda *words: runner.invoke(app, ["linearize", "craft.toml", *words])


def test_a_model_is_printed_saved_and_drawn(femflex, folder):
    found = femflex("--outputs", "bodies/hub/rate:z", "-o", "m.npz", "-o", "m.png", "--zeros", "--force")
    assert found.exit_code == 0, found.output
    words = ("bending 1", "translation x", "loads/push/torque:z", "bodies/hub/rate:z", "left out    load 'push'")
    assert all(word in found.output for word in words)
    saved = np.load(folder / "m.npz")
    assert saved["B"].shape == (len(saved["A"]), 1) and (folder / "m.png").stat().st_size > 20_000
    again = femflex("-o", "m.npz")
    assert again.exit_code == 2 and "--force" in again.output


def test_the_same_numbers_for_programs_truncated_and_as_a_nichols_chart(femflex, folder):
    found = femflex("--outputs", "bodies/hub/rate:z", "--balanced", "2", "--nichols", "-o", "n.svg", "--json")
    assert found.exit_code == 0, found.output
    data = json.loads(found.stdout)
    assert len(data["A"]) == 14 and data["inputs"] == [{"name": "loads/push/torque:z", "unit": "N m"}]
    assert (folder / "n.svg").is_file()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--inputs", "loads/pusch/torque:z"), "did you mean 'loads/push/torque:z'?"),
        (("--outputs", "bodies/hub/rates"), "did you mean 'bodies/hub/rate'?"),
        (("--run", "run.h5"), "give the time too (--at '3 s')"),
        (("--run", "none.h5", "--at", "1 s"), "none.h5"),
        (("--below", "1", "--balanced", "2"), "found --below and --balanced; give one of them"),
        (("-o", "model.csv"), "expected .mat, .npz, .h5 for a model"),
        (("--below", "1e9"), "keeps all of the poles"),
    ],
)
def test_mistakes_are_one_sentence(femflex, words, sentence):
    found = femflex(*words)
    assert found.exit_code == 2 and sentence in " ".join(found.output.split()), found.output
