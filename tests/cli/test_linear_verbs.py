"""`femflex campbell`, `linearize`, `stability` and `sweep` against closed forms."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from support.hub_beam import exact_frequencies

BLADE = """
title = "a blade"

[run]
duration = "0.2 s"
samples = 11

[attitude]
frame = "spinning"
spin = [0, 0, "60 rpm"]

[bodies.blade]
kind = "analytic"
length = 2
EA = 1e6
EIy = 40
EIz = 400
GJ = 100
mass_per_length = 1
functions = { y = 5, z = 5, family = "polynomial" }
damping = { ratio = "1 %" }

[[joints]]
kind = "weld"
child = "blade"
child_marker = "root"

[campbell]
speeds = "0:120 rpm:5"
modes = 3
orders = [1, 2]
"""
EXPECT = """
[expect.flap]
of = "campbell_frequency"
branch = "flap 1"
speed = 0
value = 0.884747
relative_tolerance = 1e-5
source = "3.51602 sqrt(EI / m L^4) sqrt(1 - 0.01^2) / 2 pi"
"""


def test_campbell_table_and_json_have_frequencies_of_blade(femflex, tmp_path):
    """Flap at rest in closed form, and of a rotating clamped beam from Wright et al. (1982), table 1."""
    (tmp_path / "blade.toml").write_text(BLADE)
    code, _, err = femflex("campbell", "blade.toml", "-o", "c.csv", "-o", "c.png")
    assert code == 0, err
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.DictReader(file))
    flap = [row for row in rows if row["branch"] == "flap 1" and row["asked"] == "1"]
    speeds, hertz = (np.array([float(row[key]) for row in flap]) for key in ("speed [rad/s]", "frequency [Hz]"))
    assert speeds == pytest.approx(np.linspace(0, 4 * np.pi, 5))
    assert float(flap[0]["damping ratio"]) == pytest.approx(0.01, rel=1e-6)
    at_rest = 3.51602 * np.sqrt(40 / 2**4)
    assert 2 * np.pi * hertz[0] == pytest.approx(at_rest * np.sqrt(1 - 0.01**2), rel=1e-5)
    assert {row["stable"] for row in rows} == {"1"} and (tmp_path / "c.png").stat().st_size > 20_000
    assert femflex("campbell", "blade.toml", "-o", "c.csv")[0] == 2  # it is there now
    unit = np.sqrt(40 / 2**4)  # rad/s, in which the table has its speeds
    words = ("--speeds", f"0, {3 * unit}, {8 * unit}", "--modes", 1, "--orders", "3")
    code, out, _ = femflex("campbell", "blade.toml", *words, "--json")
    data = json.loads(out)
    assert code == 0 and data["complete"] and {point["branch"] for point in data["points"]} == {"flap 1"}
    frequency, ratio = (np.array([row[key] for row in data["points"]]) for key in ("frequency [Hz]", "damping ratio"))
    undamped = 2 * np.pi * frequency / np.sqrt(1 - ratio**2)
    assert undamped / unit == pytest.approx([3.51602, 4.79728, 9.25684], rel=5e-5)
    assert all(crossing["order"] == 3 for crossing in data["crossings"])


@pytest.mark.slow
def test_run_leaves_campbell_diagram_and_judges_it(femflex, tmp_path):
    (tmp_path / "blade.toml").write_text(BLADE + EXPECT)
    code, out, err = femflex("run", "blade.toml", "-o", "r.h5")
    assert code == 0 and "holds" in out and "does not hold" not in out + err
    assert {"r_campbell.csv", "r_campbell.png"} <= {path.name for path in tmp_path.iterdir()}
    (tmp_path / "r.h5").unlink()
    code, _, err = femflex("run", "blade.toml", "-o", "r.h5")
    assert code == 2 and "r_campbell.csv" in err and not (tmp_path / "r.h5").exists()


@pytest.mark.slow
def test_lag_with_linear_strain_diverges_beyond_its_frequency(femflex, tmp_path):
    """Linear strain gives lag the frequency sqrt(w^2 - spin^2): past w = 17.6 rad/s it grows as sqrt(spin^2 - w^2)."""
    text = BLADE.replace('damping = { ratio = "1 %" }', 'strain = "linear"').replace("0:120 rpm:5", "0:30 rad/s:4")
    (tmp_path / "blade.toml").write_text(text.replace("modes = 3", "modes = 2"))
    code, out, _ = femflex("campbell", "blade.toml", "-o", "b.csv")
    assert code == 0
    line = " ".join(out[out.index("unstable  ") :].split())
    w = 3.516015 * np.sqrt(400 / 2**4)
    assert float(line.split(" in ")[1].split()[0]) == pytest.approx(1 / np.sqrt(30**2 - w**2), rel=1e-3)
    with (tmp_path / "b.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert all((row["damping ratio"] == "") == (float(row["frequency [Hz]"]) == 0) for row in rows)


def test_linear_model_has_exact_poles_and_rigid_gain(femflex, hub_and_beam, tmp_path):
    """Poles of the free hub with its beam; far below them the rate answers a torque as that of the rigid craft."""
    words = ("linearize", hub_and_beam(damping=0), "--outputs", "bodies/hub/rate:z")
    code, out, err = femflex(*words, "--json", "-o", "m.npz", "-o", "m.svg")
    assert code == 0, err
    data = json.loads(out)
    assert data["inputs"] == [{"name": "loads/push/torque:z", "unit": "N m"}]
    A, B, C = (np.array(data[key]) for key in "ABC")
    poles = np.sort(np.linalg.eigvals(A).imag)
    exact = exact_frequencies(0.1, 0.1, 0.5, False)
    assert poles[poles > 0.1 * exact[0]][:3] == pytest.approx(exact, rel=5e-5)
    s = 1e-2j * exact[0]
    gain = (C @ np.linalg.solve(s * np.eye(len(A)) - A, B))[0, 0]
    inertia = 0.1 + 1 / 12 + 0.5 / 1.5 * 0.6**2  # hub and beam about their common centre of mass
    assert s * gain == pytest.approx(1 / inertia, rel=1e-3)
    saved = np.load(tmp_path / "m.npz")
    for name, matrix in zip("ABC", (A, B, C), strict=True):
        np.testing.assert_allclose(saved[name], matrix, rtol=1e-12, atol=1e-12)
    assert (tmp_path / "m.svg").read_text().startswith("<?xml")
    assert femflex(*words, "-o", "m.npz")[0] == 2  # it is there now
    reduced = json.loads(femflex(*words, "--below", (exact[0] + exact[1]) / (4 * np.pi), "--json")[1])
    assert np.linalg.eigvals(np.array(reduced["A"])).imag.max() == pytest.approx(exact[0], rel=5e-5)


def test_stability_changes_where_spring_carries_pendulum(femflex, upright, tmp_path):
    """An upright pendulum on a spring is stable where k > m g l = 19.62 N m."""
    path = upright("damping = 0.1\nstiffness = 30\n")
    words = ("stability", path, "--vary", "joints.0.stiffness=10:30:5")
    code, out, err = femflex(*words, "--json", "-o", "l.csv")
    assert code == 0, err
    assert json.loads(out)["changes"] == pytest.approx([2 * 9.81], rel=1e-6)
    with (tmp_path / "l.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        growth = np.roots([3.0, 0.1, float(row["joints.0.stiffness"]) - 19.62]).real.max()
        assert float(row["growth"]) == pytest.approx(max(growth, 0.0), rel=1e-6)


def test_sweep_of_inertia_and_torque_has_closed_form(femflex, tmp_path):
    (tmp_path / "spun.toml").write_text("""
        run = { duration = "2 s", samples = 11 }
        bodies.wheel = { kind = "rigid", mass = 3, inertia = [2, 2, 2] }
        joints = [{ kind = "revolute", child = "wheel" }]
        loads = [{ name = "motor", body = "wheel", torque = [0, 0, "4 N m"] }]
    """)
    (tmp_path / "study.toml").write_text("""
        case = "spun.toml"
        design = "list"
        [vary."bodies.wheel.inertia.2"]
        values = [1, 2, 2.5]
        [outputs.speed]
        of = "value"
        channel = "bodies/wheel/rate"
        component = "z"
    """)
    code, out, err = femflex("sweep", "study.toml", "--workers", 1, "-o", "s.h5", "--json")
    assert code == 0, err
    data = json.loads(out)
    assert data["outputs"]["speed"] == pytest.approx([8.0, 4.0, 3.2], rel=1e-9), data
    assert femflex("sweep", "study.toml", "-o", "s.h5")[0] == 2 and Path("s.h5").exists()
