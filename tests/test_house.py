"""The repository in order: formatting, lint, types, files at the top level, size of the tests."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[1]
CEILING = 0.5  # lines of tests for each line of the package; it may only be lowered
FOLDERS = {"femflex", "meshes", "tests", "cases", "docs", ".ci"}
KNOWN = FOLDERS | {"pyproject.toml", "README.md", "CHANGELOG.md", "LICENSE", ".gitignore"}


def tool(*words: str, folder: Path = TOP) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *words], cwd=folder, capture_output=True, text=True, check=False)


def test_top_level_has_known_files_alone():
    listed = subprocess.run(["git", "ls-files"], cwd=TOP, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    assert {line.split("/")[0] for line in listed.stdout.split()} == KNOWN


@pytest.mark.parametrize("arguments", [("check",), ("format", "--check")], ids=["lint", "format"])
def test_ruff_finds_no_problem(arguments):
    process = tool("ruff", *arguments, "femflex", "tests", "meshes", "docs")
    assert process.returncode == 0, process.stdout


@pytest.mark.slow
def test_mypy_finds_no_problem():
    process = tool("mypy")
    assert process.returncode == 0, process.stdout


def test_ratio_of_test_lines_to_code_lines_stays_below_its_ceiling():
    tests = [*(TOP / "tests").rglob("*.py"), *(TOP / "tests" / "messages").rglob("*.toml")]
    code = list((TOP / "femflex").rglob("*.py"))
    n_tests, n_code = (sum(path.read_bytes().count(b"\n") for path in paths) for paths in (tests, code))
    assert n_tests <= CEILING * n_code, f"{n_tests} lines of tests for {n_code} of code"


def test_every_test_module_has_a_unique_name():
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
def test_folders_with_a_conftest_each_are_collected_together(folders, tmp_path):
    options = ["--collect-only", "-q", "-p", "no:cacheprovider", f"--ignore-glob={TOP}/tests/*/test_*.py"]
    process = tool("pytest", *(str(TOP / "tests" / name) for name in folders), *options, folder=tmp_path)
    assert process.returncode == pytest.ExitCode.NO_TESTS_COLLECTED, process.stdout
