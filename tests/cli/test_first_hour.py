"""The first hour: first steps, shipped cases, templates, the doctor, and the package as others install it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import pytest

from femflex.extras import PACKAGES, MissingExtra, require

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


@pytest.mark.sampled(3)
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


def test_extras_of_messages_are_those_of_the_package():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert set(PACKAGES) <= set(extras)
    with pytest.raises(MissingExtra, match=r'kites need .*: pip install "femflex\[view\]"'):
        require("view", "kites", "no_such_package")


LEFT_OUT = (".git", ".venv", "build", "dist", "_build", "*.egg-info", "__pycache__", ".*_cache", "*.h5", "*.mp4")
CORE = 620e6  # bytes of an installation that draws nothing


@pytest.mark.slow
def test_built_packages_run_in_a_clean_environment(tmp_path):
    """An archive, and a wheel from it, are built; each, installed without extras, copies, checks and runs cases."""
    shutil.copytree(ROOT, tmp_path / "source", ignore=shutil.ignore_patterns(*LEFT_OUT))
    build = [sys.executable, "-m", "build", "--outdir", tmp_path / "dist", tmp_path / "source"]
    subprocess.run(build, check=True, capture_output=True)
    venv.create(tmp_path / "env", with_pip=True)
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    (python,) = (*tmp_path.glob("env/bin/python"), *tmp_path.glob("env/Scripts/python.exe"))

    def run(*arguments: str, code: int = 0) -> str:
        command = [python, "-m", *arguments]
        done = subprocess.run(command, cwd=tmp_path, env=clean, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        return done.stdout + done.stderr

    for kind, options in (("whl", []), ("tar.gz", ["--no-deps", "--force-reinstall"])):
        (package,) = (tmp_path / "dist").glob(f"femflex-*.{kind}")
        run("pip", "install", "--quiet", *options, str(package))
        assert "copied" in run("femflex", "examples", "orbiter_beam", "chaplygin_sleigh", "spin_up", "-o", kind)
        assert "no problems" in run("femflex", "check", f"{kind}/cases/orbiter_beam.toml")
        assert 'pip install "femflex[view]"' in run("femflex", "run", f"{kind}/cases/chaplygin_sleigh.toml", "--force")
    (package,) = tmp_path.glob("env/**/femflex/__init__.py")
    sizes = [path.stat().st_size for path in package.parents[1].rglob("*") if path.is_file()]
    assert sum(sizes) < CORE and not (package.parents[1] / "vtkmodules").exists()
    run("femflex", "modes", "whl/cases/spin_up.toml")
    run("femflex", "converge", "whl/cases/spin_up.toml", "--over", "modes", "--levels", "1,2")
    for end in ("glb", "csv"):
        run("femflex", "export", "chaplygin_sleigh.h5", "-o", f"sleigh.{end}")
    for arguments in (("render",), ("plot",), ("export", "-o", "sleigh.vtkhdf"), ("report",)):
        verb, *options = arguments
        assert "pip install" in run("femflex", verb, "chaplygin_sleigh.h5", *options, code=2)
