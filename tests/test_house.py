"""The house in order: formatting, lint, types, and what stands at the top level."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[1]
FOLDERS = {"femflex", "meshes", "tests", "cases", "docs", ".ci"}
KNOWN = FOLDERS | {"pyproject.toml", "README.md", "CHANGELOG.md", "LICENSE", ".gitignore"}


def tool(*words: str, folder: Path = TOP) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *words], cwd=folder, capture_output=True, text=True, check=False)


def test_top_level_holds_what_it_should_and_nothing_else():
    listed = subprocess.run(["git", "ls-files"], cwd=TOP, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    assert {line.split("/")[0] for line in listed.stdout.split()} == KNOWN


@pytest.mark.parametrize("words", [("check",), ("format", "--check")], ids=["lint", "format"])
def test_ruff_is_content(words):
    found = tool("ruff", *words, "femflex", "tests", "meshes", "docs")
    assert found.returncode == 0, found.stdout


@pytest.mark.slow
def test_mypy_is_content_with_the_package():
    found = tool("mypy")
    assert found.returncode == 0, found.stdout


def test_every_test_module_has_a_name_of_its_own():
    """pytest takes modules of one name in two folders for one, and collects neither."""
    names = [path.name for path in (TOP / "tests").rglob("*.py") if path.name != "conftest.py"]
    assert sorted(names) == sorted(set(names))


def test_tests_import_no_test_module_and_no_private_name():
    """Shared builders are fixtures or stand in tests/support; any file can be run alone."""
    tests = TOP / "tests"
    modules = {path.stem for path in tests.rglob("test_*.py")}
    for path in tests.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                assert node.module not in modules, f"{path} imports the test module {node.module}"
                private = [alias.name for alias in node.names if alias.name.startswith("_")]
                assert path.parent.name == "benchmarks" or not private, f"{path} imports {private}"


@pytest.mark.slow
@pytest.mark.parametrize("folders", [("view", "studies"), ("studies", "view")], ids="+".join)
def test_two_folders_with_a_conftest_each_are_collected_together_from_anywhere(folders, tmp_path):
    words = ["--collect-only", "-q", "-p", "no:cacheprovider", f"--ignore-glob={TOP}/tests/*/test_*.py"]
    found = tool("pytest", *(str(TOP / "tests" / name) for name in folders), *words, folder=tmp_path)
    assert found.returncode == pytest.ExitCode.NO_TESTS_COLLECTED, found.stdout
