"""The first hour: first steps, shipped cases, templates, the doctor, and the package as others install it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_first_steps_without_a_verb(femflex):
    code, out, _ = femflex()
    assert code == 0 and all(word in out for word in ("doctor", "examples", "new", "check", "run", "--help"))


def test_shipped_cases_are_copied_with_their_files(femflex, tmp_path):
    code, _, _ = femflex("examples", "sail_trim", "gimbal_antenna", "-o", "mine")
    assert code == 0
    for name in ("cases/sail_trim.toml", "meshes/sail.msh", "cases/ground_station.csv", "cases/case.schema.json"):
        assert (tmp_path / "mine" / name).read_bytes() == (ROOT / name).read_bytes()
    assert femflex("check", "mine/cases/gimbal_antenna.toml")[0] == 0
    code, _, err = femflex("examples", "sailtrim", "-o", "other")
    assert code == 2 and "sail_trim" in err and not (tmp_path / "other").exists()


@pytest.mark.parametrize("word", ["panels", "boom", "deployment", "tether", "sail", "deck"])
def test_templates_are_cases_without_problems(femflex, word):
    code, out, _ = femflex("new", "mine.toml", "--template", word)
    assert code == 0 and "mine.toml" in out
    assert femflex("check", "mine.toml")[0] == 0
    code, _, err = femflex("new", "mine.toml", "--template", word)
    assert code == 2 and "mine.toml exists" in err


def test_doctor_finds_what_works(femflex):
    code, out, _ = femflex("doctor", "--json")
    facts = json.loads(out)
    assert code == (3 if facts["failed"] else 0)
    assert "equations" not in facts["failed"] and "numpy" in facts["libraries"]


@pytest.mark.slow
def test_built_wheel_has_the_cases(tmp_path):
    """A wheel and an archive are built, the wheel is installed elsewhere, and a shipped case checks there."""
    pip = [sys.executable, "-m", "pip"]
    subprocess.run([*pip, "wheel", "--quiet", "--no-deps", "-w", tmp_path / "dist", ROOT], check=True)
    (wheel,) = (tmp_path / "dist").glob("femflex-*.whl")
    subprocess.run(
        [*pip, "install", "--quiet", "--no-deps", "--prefix", tmp_path / "p", "--ignore-installed", wheel], check=True
    )
    (package,) = (tmp_path / "p").rglob("femflex/__init__.py")
    environment = {**os.environ, "PYTHONPATH": str(package.parents[1])}

    def run(*arguments: str) -> str:
        command = [sys.executable, "-m", "femflex", *arguments]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return done.stdout

    assert "copied" in run("examples", "orbiter_beam", "-o", "mine")
    assert "no problems" in run("check", "mine/cases/orbiter_beam.toml")
    where = subprocess.run(
        [sys.executable, "-c", "import femflex; print(femflex.__file__)"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert Path(where.stdout.strip()) == package
