"""What all tests share: off-screen rendering, one thread, and a small craft as a case file."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
os.environ.setdefault("MPLBACKEND", "agg")

CRAFT = """
title = "hub with a boom"

[run]
duration = "10 s"
output_step = 0.05

[attitude]
rates = ["2 deg/s", 0, 0.01]

[materials.aluminium]
E = "70 GPa"
nu = 0.33
density = "2700 kg/m^3"

[sections.tube]
kind = "tube"
outer_radius = "30 mm"
thickness = "2 mm"

[bodies.hub]
kind = "rigid"
mass = 200
inertia = [120, 100, 140]
markers.left = { position = [0.5, 0, 0] }

[bodies.boom]
kind = "flexible"
mesh = "boom.inp"
members = [{ group = "BOOM", family = "beam", section = "tube", material = "aluminium" }]
reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }
damping = { ratio = "0.5 %" }
markers.tip = { group = "TIP" }
initial = { marker = "tip", displacement = [0, "10 mm", 0] }

[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "left"
child = "boom"
child_marker = "ROOT"

[[loads]]
name = "push"
body = "hub"
torque = [[0, 0, 1], [0, 0, 1]]
times = [0, 2]
"""

BOOM = """*NODE
1, 0.0, 0.0, 0.0
2, 1.0, 0.0, 0.0
3, 2.0, 0.0, 0.0
4, 3.0, 0.0, 0.0
*ELEMENT, TYPE=B31, ELSET=BOOM
1, 1, 2
2, 2, 3
3, 3, 4
*NSET, NSET=ROOT
1
*NSET, NSET=TIP
4
*NSET, NSET=NOTHING
"""


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

    def call(*arguments: object) -> tuple[int, str, str]:
        done = CliRunner().invoke(app, [str(argument) for argument in arguments])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        return done.exit_code, done.stdout, done.stderr

    return call
