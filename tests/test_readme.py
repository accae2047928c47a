"""The README is short, and its two install commands work in a fresh copy; tests/docs runs its other commands."""

import os
import re
import subprocess
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[1]
README = (TOP / "README.md").read_text(encoding="utf-8")
LARGEST = 10_000  # bytes


def block(name: str) -> str:
    """The code block after the comment <!-- name -->."""
    found = re.search(rf"<!-- {name} -->\n```\w+\n(.*?)```", README, re.DOTALL)
    assert found, f"the README has no block {name!r}"
    return found[1]


def test_the_readme_is_short():
    assert len(README.encode()) <= LARGEST


def test_readme_tour_shows_nine_verbs_once():
    verbs = [line.split()[1] for line in block("tour").splitlines()]
    assert len(set(verbs)) == len(verbs) == 9


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run command", "test command"])
def test_both_commands_work_in_a_fresh_copy(name, tmp_path):
    subprocess.run(["git", "clone", "--quiet", str(TOP), str(tmp_path / "femflex")], check=True)
    keep = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(block(name), shell=True, cwd=tmp_path / "femflex", env=keep, check=False)
    assert done.returncode == 0
