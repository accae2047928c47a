"""Fixtures of all tests: off-screen rendering, one thread, and a small craft as a case file."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from support.compiled_once import compile_kernels
from support.small_craft import BOOM, CRAFT

# doctest would import every conftest.py as a module of that one name
collect_ignore_glob = ["*conftest.py"]

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
os.environ.setdefault("MPLBACKEND", "agg")


def pytest_configure(config: pytest.Config) -> None:
    """Compile kernels that are not on disk yet, before tests begin in several processes."""
    processes = getattr(config.option, "numprocesses", None)
    if processes and not hasattr(config, "workerinput"):
        compile_kernels(processes)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test marked `sampled(n)`, n of its cases, spread evenly, stay fast tests; the others become slow ones."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("sampled"):
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for found in cases.values():
        (count,) = found[0].get_closest_marker("sampled").args
        fast = {round((k + 0.5) * len(found) / count - 0.5) for k in range(count)} if len(found) > count else None
        for k, item in enumerate(found):
            if fast is not None and k not in fast:
                item.add_marker(pytest.mark.slow)


@cache
def _command(app: Any) -> Any:
    """The verbs put together once: that takes as long as most calls of one."""
    from typer.main import get_command

    return get_command(app)


@pytest.fixture
def craft() -> str:
    """Text of a case: a rigid hub with a meshed boom."""
    return CRAFT


@pytest.fixture
def write_case(tmp_path: Path) -> Callable[..., Path]:
    """Writes a case text and the boom's mesh beside it; returns the case's path."""

    def write(text: str = CRAFT, name: str = "craft.toml") -> Path:
        (tmp_path / "boom.inp").write_text(BOOM)
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.fixture
def femflex(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, str, str]]:
    """Runs the command line in a folder of its own; returns exit code, standard output and standard error."""
    from typer.testing import CliRunner

    from femflex.cli.app import app

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("typer.testing._get_command", _command, raising=False)

    def call(*arguments: object) -> tuple[int, str, str]:
        done = CliRunner().invoke(app, [str(argument) for argument in arguments])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        return done.exit_code, done.stdout, done.stderr

    return call
