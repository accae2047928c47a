"""Every command of the README is run: the tour and the API here, the two install commands in the slow suite."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[1]
README = (TOP / "README.md").read_text(encoding="utf-8")


def block(name: str) -> str:
    """The code block after the comment <!-- name -->."""
    found = re.search(rf"<!-- {name} -->\n```\w+\n(.*?)```", README, re.DOTALL)
    assert found, f"the README has no block {name!r}"
    return found[1]


TOUR = [line.split("#")[0].strip() for line in block("tour").splitlines()]


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """A copy of what the tour touches."""
    top = tmp_path_factory.mktemp("clone")
    for folder in ("cases", "meshes"):
        shutil.copytree(TOP / folder, top / folder)
    return top


@pytest.mark.parametrize("command", TOUR)
def test_commands_of_the_tour_work_in_their_order(command, clone):
    words = [sys.executable, "-m", "femflex", *command.split()[1:]]
    done = subprocess.run(words, cwd=clone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    if "-o" in words:
        assert (clone / words[words.index("-o") + 1]).stat().st_size > 0


def test_the_api_in_ten_lines_works(monkeypatch, capsys):
    monkeypatch.chdir(TOP)
    assert len([line for line in block("api").splitlines() if line]) <= 10
    exec(compile(block("api"), "README.md", "exec"), {})
    assert capsys.readouterr().out == "(3,)\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run command", "test command"])
def test_both_commands_work_in_a_fresh_copy(name, tmp_path):
    subprocess.run(["git", "clone", "--quiet", str(TOP), str(tmp_path / "femflex")], check=True)
    keep = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(block(name), shell=True, cwd=tmp_path / "femflex", env=keep, check=False)
    assert done.returncode == 0
