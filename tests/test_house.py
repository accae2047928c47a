"""The house in order: formatting, lint, types, and what stands at the top level."""

import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[1]
KNOWN = {"pyproject.toml", "femflex", "meshes", "tests", "cases", "README.md", "LICENSE", ".gitignore", ".ci"}


def tool(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *words], cwd=TOP, capture_output=True, text=True, check=False)


def test_top_level_holds_what_it_should_and_nothing_else():
    listed = subprocess.run(["git", "ls-files"], cwd=TOP, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    assert {line.split("/")[0] for line in listed.stdout.split()} == KNOWN


@pytest.mark.parametrize("words", [("check",), ("format", "--check")], ids=["lint", "format"])
def test_ruff_is_content(words):
    found = tool("ruff", *words, "femflex", "tests", "meshes")
    assert found.returncode == 0, found.stdout


def test_mypy_is_content_with_the_package():
    found = tool("mypy")
    assert found.returncode == 0, found.stdout


def test_every_test_module_has_a_name_of_its_own():
    """pytest takes modules of one name in two folders for one, and collects neither."""
    names = [path.name for path in (TOP / "tests").rglob("*.py") if path.name != "conftest.py"]
    assert sorted(names) == sorted(set(names))
