"""`femflex equilibrium`, and runs that start from one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from femflex.results import open_run

CASES = Path(__file__).parents[2] / "cases"

SPUN = """
title = "sprung rod on a spinning hub"

[run]
duration = "2 s"
samples = 21
rtol = 1e-9

[attitude]
frame = "spinning"
spin = [0, 0, "3 rad/s"]
root = "hub"
held = true

[bodies.hub]
kind = "rigid"
mass = 10
inertia = [1, 1, 1]
markers.rim = { position = [0.7, 0, 0] }

[bodies.rod]
kind = "rigid"
mass = 2
inertia = [0.02, 0.5, 0.5]
center_of_mass = [1.2, 0, 0]
markers.end = { position = [2.4, 0, 0] }

[[joints]]
kind = "revolute"
parent = "hub"
parent_marker = "rim"
child = "rod"
name = "hinge"
axis = [0, 1, 0]
stiffness = 40
damping = 3
rest = -0.6
"""


def position_of(marker: str, data: dict[str, list[dict[str, float]]]) -> list[float]:
    """Position of a marker in what `femflex equilibrium --json` prints."""
    (row,) = [row for row in data["marker"] if row["marker"] == marker]
    return [row[f"{axis}, m"] for axis in "xyz"]


def test_equilibrium_balances_spring_and_centrifugal_moment(femflex, tmp_path):
    """k (a - a0) + w^2 [m c sin a (r + c cos a) + (J_z - J_x) sin a cos a] = 0; a run from there stays there."""
    (tmp_path / "spun.toml").write_text(SPUN)
    code, out, _ = femflex("equilibrium", "spun.toml", "--json", "-o", "eq.h5")
    data = json.loads(out)
    assert code == 0 and data["stable"] is True and data["residual"] < 1e-9
    a = data["coordinates"]["hinge.angle"]
    spring = 40 * (a + 0.6)
    centrifugal = 9 * (2 * 1.2 * np.sin(a) * (0.7 + 1.2 * np.cos(a)) + (0.5 - 0.02) * np.sin(a) * np.cos(a))
    assert spring + centrifugal == pytest.approx(0.0, abs=1e-7)
    with open_run(tmp_path / "eq.h5") as run:
        assert run.complete and "stable" in run.ended and len(run) == 1
        assert run["q"][0] == pytest.approx(list(data["coordinates"].values()), abs=1e-15)
        assert run["markers/rod.end/position"][0] == pytest.approx(position_of("rod.end", data), abs=1e-12)
    assert femflex("equilibrium", "spun.toml", "-o", "eq.h5")[0] == 2
    for start in ('\n[initial]\nfrom = "eq.h5"\n', ""):
        (tmp_path / "run.toml").write_text(SPUN + start)
        assert femflex("run", "run.toml", "--force")[0] == 0
        with open_run(tmp_path / "run.h5") as run:
            angle = run["q"][:, run.names("q").index("hinge.angle")]
            assert angle == pytest.approx(a, abs=1e-7) if start else np.ptp(angle) > 0.1


def test_craft_without_equilibrium_exits_with_3_and_keeps_last_state(femflex, tmp_path):
    text = SPUN + '\n[[loads]]\nname = "push"\nbody = "rod"\nmarker = "end"\nframe = "body"\nforce = [0, 0, 100]\n'
    for old, new in (("stiffness = 40\n", ""), ("rest = -0.6\n", ""), ('[0, 0, "3 rad/s"]', "[0, 0, 0]")):
        text = text.replace(old, new)
    (tmp_path / "spun.toml").write_text(text)
    code, _, err = femflex("equilibrium", "spun.toml", "-o", "eq.h5")
    assert code == 3 and "hinge.angle" in err
    with open_run(tmp_path / "eq.h5") as run:
        assert not run.complete and len(run) == 1


def test_upright_pendulum_is_unstable_and_stable_option_leaves_it(femflex, upright):
    path = upright()
    assert json.loads(femflex("equilibrium", path, "--json")[1])["stable"] is False
    data = json.loads(femflex("equilibrium", path, "--stable", "--json")[1])
    assert np.cos(data["coordinates"]["hinge.angle"]) == pytest.approx(-1.0) and data["stable"]
    assert data["left"] == pytest.approx(np.sqrt(2 * 9.81 / 3), rel=1e-6)


@pytest.mark.slow
def test_coupler_of_four_bar_is_a_two_force_member(femflex, tmp_path):
    text = (CASES / "four_bar.toml").read_text(encoding="utf-8")
    load = '[[loads]]\nname = "push"\nbody = "rocker"\nmarker = "tip"\nframe = "inertial"\nforce = [0, -5, 0]\n'
    (tmp_path / "sprung.toml").write_text(text.replace('rate = "4 rad/s"', "stiffness = 20\nrest = 0.4") + load)
    code, out, _ = femflex("equilibrium", "sprung.toml", "--json")
    data = json.loads(out)
    assert code == 0 and data["stable"] and data["loops"] < 1e-12 and "rigid" not in data
    root, tip = (np.array(position_of(f"coupler.{end}", data)) for end in ("root", "tip"))
    force = np.array(data["loop"][0]["force"])
    assert np.linalg.norm(force) > 1.0
    assert np.linalg.norm(np.cross(force, tip - root)) < 1e-7 * np.linalg.norm(force) * np.linalg.norm(tip - root)
