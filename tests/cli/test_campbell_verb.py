"""`femflex campbell`: what it prints and writes, what it keeps when broken off, and its answers to mistakes."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

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

[expect.flap]
of = "campbell_frequency"
branch = "flap 1"
speed = 0
value = 0.884747
relative_tolerance = 1e-5
source = "3.51602 sqrt(EI / m L^4) sqrt(1 - 0.01^2) / 2 pi"
"""
LOAD = '\n[[loads]]\nname = "push"\nbody = "blade"\nmarker = "tip"\nframe = "inertial"\nforce = [0, 0, 1]\n'


@pytest.fixture
def blade(tmp_path):
    """Writes the blade's case, with pieces of it replaced and more text."""

    def write(*pairs: tuple[str, str], more: str = ""):
        text = BLADE + more
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "blade.toml"
        path.write_text(text)
        return path

    return write


def test_screen_table_and_picture_tell_the_same(femflex, blade, tmp_path):
    code, said, _ = femflex("campbell", blade(), "-o", "c.csv", "-o", "c.png")
    assert code == 0
    for word in ("a blade", "rpm", "flap 1", "lag 1", "1/rev", "damping ratio", "stable", "flap: 0.88474", "holds"):
        assert word in said
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.DictReader(file))
    flap = [row for row in rows if row["branch"] == "flap 1" and row["asked"] == "1"]
    assert [float(row["speed [rad/s]"]) for row in flap] == pytest.approx(np.linspace(0, 4 * np.pi, 5))
    assert float(flap[0]["damping ratio"]) == pytest.approx(0.01, rel=1e-6)
    assert all(f"{float(row['frequency [Hz]']):.6g}" in said for row in flap)
    assert {row["stable"] for row in rows} == {"1"} and flap[0]["character"] == "flap"
    assert (tmp_path / "c.png").stat().st_size > 20_000
    code, _, wrong = femflex("campbell", blade(), "-o", "c.csv")
    assert code == 2 and "exists" in wrong


def test_options_stand_for_what_the_case_says_and_json_holds_everything(femflex, blade):
    path = blade(('[campbell]\nspeeds = "0:120 rpm:5"\nmodes = 3\norders = [1, 2]\n', ""), ("[expect.flap]", "[x]"))
    path.write_text(path.read_text().partition("[x]")[0])
    options = ("--speeds", "0, 1, 2.5", "--modes", 1, "--orders", "3")
    code, said, _ = femflex("campbell", path, *options, "--json")
    data = json.loads(said)
    assert code == 0 and data["complete"] and data["speeds"] == [0.0, 1.0, 2.5]
    assert [branch["name"] for branch in data["branches"]] == ["flap 1"]
    assert all(crossing["order"] == 3 for crossing in data["crossings"])


@pytest.mark.slow
def test_a_run_leaves_the_diagram_beside_its_result(femflex, blade, tmp_path):
    code, said, _ = femflex("run", blade(), "-o", "r.h5")
    assert code == 0 and "flap: 0.88474" in said and "frequency in the spinning frame" in said
    assert {"r_campbell.csv", "r_campbell.png"} <= {path.name for path in tmp_path.iterdir()}
    (tmp_path / "r.h5").unlink()
    code, _, wrong = femflex("run", blade(), "-o", "r.h5")
    assert code == 2 and "r_campbell.csv" in wrong and not (tmp_path / "r.h5").exists()


@pytest.mark.parametrize("stop", ["interrupt", "no equilibrium"])
def test_what_was_found_is_kept_when_it_is_broken_off(stop, femflex, blade, tmp_path, monkeypatch):
    from femflex.dynamics.equilibria.equilibrium import EquilibriumError
    from femflex.studies.campbell import sweep

    plain = sweep.equilibrium

    def failing(system):
        if system.frame.rate[2] > 9:
            raise KeyboardInterrupt if stop == "interrupt" else EquilibriumError("there is none", None)
        return plain(system)

    monkeypatch.setattr(sweep, "equilibrium", failing)
    code, said, wrong = femflex("campbell", blade(), "-o", "c.csv")
    assert code == (130 if stop == "interrupt" else 3)
    assert "broken off after 3 of 5 speeds" in wrong
    assert stop == "interrupt" or "at a spin of 9.42478 rad/s there is none" in wrong
    assert "\n60 " in said and "\n90 " not in said
    assert "expected " not in said  # of a whole diagram
    assert (tmp_path / "c.csv").stat().st_size > 0


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("0:400", "found '0:400'; expected speeds such as '0:400 rpm:17'"),
        ("0:400 rpm:1", "found '1' speeds in '0:400 rpm:1'; give a whole number from 2"),
        ("400:0 rpm:5", "found speeds that do not rise: 400, 300, 200, 100, 0 rpm"),
        ("0:400 Hz:5", "found '0 Hz', which is a rate per second; expected an angular rate"),
        ("0:4 parsecs:5", "expected speeds such as"),
        ("fast", "found 'fast', which does not begin with a number"),
        ("1,,2", "found '1,,2'; expected speeds"),
        ("-1:2:3", "found speeds from -1 rad/s; they begin at 0 or above"),
        ("3", "found 1 speed; a diagram needs at least two"),
    ],
)
def test_speeds_that_cannot_be_read_are_told(given, told, femflex, blade):
    code, _, wrong = femflex("campbell", blade(), f"--speeds={given}")
    assert code == 2 and "--speeds" in wrong and told in wrong
    code, _, wrong = femflex("check", blade(('"0:120 rpm:5"', f'"{given}"')))
    assert code == 2 and "campbell.speeds" in wrong and told in wrong


@pytest.mark.slow
def test_crafts_that_cannot_spin_steadily_are_told(femflex, blade):
    code, _, wrong = femflex("campbell", blade(more=LOAD))
    assert code == 2 and "load 'push' keeps its direction in the inertial frame" in wrong
    code, _, wrong = femflex("campbell", blade(more='\n[orbit]\nperigee_altitude = "400 km"\n'))
    assert code == 2 and "campbell: found an [orbit], on which no spin speed is steady" in wrong
    still = blade(('[attitude]\nframe = "spinning"\nspin = [0, 0, "60 rpm"]\n', ""))
    code, _, wrong = femflex("campbell", still)
    assert code == 2 and "campbell.axis: found no axis to spin about" in wrong
    still.write_text(still.read_text().replace("[campbell]", "[campbell]\naxis = [0, 0, 0]"))
    code, _, wrong = femflex("campbell", still)
    assert code == 2 and "found an axis of no length" in wrong
    still.write_text(still.read_text().replace("axis = [0, 0, 0]", "axis = [0, 0, 1]"))
    assert femflex("campbell", still)[0] == 0
    rigid = blade()
    rigid.write_text(
        '[run]\nduration = 1\n[bodies.hub]\nkind = "rigid"\nmass = 1\ninertia = [1, 1, 1]\n'
        '[[joints]]\nkind = "weld"\nchild = "hub"\n[campbell]\nspeeds = [0, 1]\naxis = [0, 0, 1]\n'
    )
    code, _, wrong = femflex("campbell", rigid)
    assert code == 2 and "the craft has no vibration" in wrong


def test_a_case_without_campbell_and_wrong_answers_are_told(femflex, blade):
    code, _, wrong = femflex("campbell", blade(("speed = 0\n", 'speed = "50 rpm"\n')))
    assert code == 2 and "expect.flap.speed: found 50 rpm, which is none of the diagram's 5 speeds (0, 30, 60" in wrong
    code, _, wrong = femflex("campbell", blade(("speed = 0\n", "")))
    assert code == 2 and "branch and speed go with of = 'campbell_frequency', which needs both" in wrong
    code, _, wrong = femflex("campbell", blade(('"flap 1"', '"torsion 1"')))
    assert code == 2 and "branch 'torsion 1' is not in the diagram; it has flap 1" in wrong
    path = blade(('[campbell]\nspeeds = "0:120 rpm:5"\nmodes = 3\norders = [1, 2]\n', ""))
    code, _, wrong = femflex("campbell", path)
    assert code == 2 and "found 'campbell_frequency' in a case without a [campbell]" in wrong
    path.write_text(path.read_text().partition("[expect.flap]")[0])
    code, _, wrong = femflex("campbell", path)
    assert code == 2 and "campbell: the case has none; give one with speeds" in wrong
    code, _, wrong = femflex("campbell", blade(), "--orders", "0,1")
    assert code == 2 and "--orders is '0,1'" in wrong
    code, _, wrong = femflex("campbell", blade(), "-o", "c.h5")
    assert code == 2 and "expected .csv for a table" in wrong


@pytest.mark.slow
def test_stiffening_that_linear_strain_leaves_out_is_told_with_both_numbers(femflex, blade):
    linear = blade(('kind = "analytic"\n', 'kind = "analytic"\nstrain = "linear"\n'))
    code, _, wrong = femflex("campbell", linear)
    assert code == 0 and "turned at up to 12.57 rad/s" in wrong and "is left out by linear strain" in wrong
    assert "turned at" not in femflex("campbell", blade())[2]


@pytest.mark.slow
def test_what_grows_without_swinging_has_a_time_and_no_damping(blade, femflex):
    """Linear strain gives lag the frequency sqrt(w^2 - spin^2): past w = 17.6 rad/s it grows as sqrt(spin^2 - w^2)."""
    pairs = (
        ('damping = { ratio = "1 %" }', 'strain = "linear"'),
        ("0:120 rpm:5", "0:30 rad/s:4"),
        ("modes = 3", "modes = 2"),
    )
    case = blade(*pairs)
    case.write_text(case.read_text().split("[expect")[0])
    code, out, _ = femflex("campbell", case, "-o", "b.csv")
    w = 3.516015 * np.sqrt(400 / 2**4)
    assert code == 0 and "damping ratio" not in out
    line = next(row for row in out.splitlines() if row.startswith("unstable"))
    assert "grows from 20 rad/s on, fastest at 30 rad/s, by a factor e in" in line
    assert float(line.split(" in ")[1].split()[0]) == pytest.approx(1 / np.sqrt(30**2 - w**2), rel=1e-3)
    with open("b.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["damping ratio"] for row in rows} == {"", "0.0"}
    assert all((row["damping ratio"] == "") == (float(row["frequency [Hz]"]) == 0) for row in rows)
