"""`femflex equilibrium`, and runs that start from one: what they print, write, and answer to mistakes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.case import read_case
from femflex.cli.app import app
from femflex.pipeline.balanced import balanced
from femflex.results import open_run
from femflex.warning import PhysicsWarning

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
START = '\n[initial]\nfrom = "{}"\n'
PUSH = '\n[[loads]]\nname = "push"\nbody = "rod"\nmarker = "end"\nframe = "{}"\nforce = {}\n'


def told(*words):
    """Exit code, standard output and standard error of a command."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture
def case(tmp_path):
    """Writes the spinning rod's case, with more text, beside what else there is."""

    def write(more: str = "", name: str = "spun.toml"):
        path = tmp_path / name
        path.write_text(SPUN + more)
        return path

    return write


def test_the_screen_tells_coordinates_markers_residual_and_stability(case):
    code, said, _ = told("equilibrium", case())
    assert code == 0
    for word in (
        "sprung rod",
        "hinge.angle",
        "rod.end",
        "spins at [0, 0, 3] rad/s",
        "residual",
        "iterations",
        "stable",
    ):
        assert word in said


def test_json_and_the_result_file_hold_the_same_state(case, tmp_path):
    code, said, _ = told("equilibrium", case(), "--json", "-o", tmp_path / "eq.h5")
    assert code == 0
    data = json.loads(said)
    assert data["stable"] is True and data["residual"] < 1e-9 and data["frame"] == "spinning"
    with open_run(tmp_path / "eq.h5") as run:
        assert run.complete and "stable" in run.ended and len(run) == 1
        assert run["q"][0] == pytest.approx(list(data["coordinates"].values()), abs=1e-15)
        assert run["markers/rod.end/position"][0] == pytest.approx(data["markers"]["rod.end"]["position"], abs=1e-12)
    code, _, wrong = told("equilibrium", case(), "-o", tmp_path / "eq.h5")
    assert code == 2 and "exists" in wrong


@pytest.mark.sampled(1)
@pytest.mark.parametrize("source", ["equilibrium", "eq.h5"])
def test_a_run_that_starts_in_equilibrium_stays_there(source, case, tmp_path):
    found = json.loads(told("equilibrium", case(), "--json", "-o", tmp_path / "eq.h5")[1])
    moving = case(START.format(source), "run.toml")
    assert told("run", moving, "-o", tmp_path / "run.h5")[0] == 0
    with open_run(tmp_path / "run.h5") as run:
        turned = run["q"][:, run.names("q").index("hinge.angle")]
        assert turned == pytest.approx(found["coordinates"]["hinge.angle"], abs=1e-7)
    from_rest = case("", "free.toml")
    assert told("run", from_rest, "-o", tmp_path / "free.h5")[0] == 0
    with open_run(tmp_path / "free.h5") as run:
        assert np.ptp(run["q"][:, run.names("q").index("hinge.angle")]) > 0.1


def test_a_craft_that_finds_no_rest_keeps_what_was_reached_and_exits_with_3(case, tmp_path):
    path = case(PUSH.format("body", "[0, 0, 100]"))
    path.write_text(
        path.read_text()
        .replace("stiffness = 40\n", "")
        .replace("rest = -0.6\n", "")
        .replace('[0, 0, "3 rad/s"]', "[0, 0, 0]")
    )
    code, _, wrong = told("equilibrium", path, "-o", tmp_path / "eq.h5")
    assert code == 3
    assert "no equilibrium was found beyond 0 of the loads" in wrong and "nothing resists hinge.angle" in wrong
    assert "keeps the last state, and is marked incomplete" in wrong
    with open_run(tmp_path / "eq.h5") as run:
        assert not run.complete and "no equilibrium" in run.ended and len(run) == 1


@pytest.mark.slow
def test_beside_loops_it_tells_what_they_carry_and_how_well_they_close(tmp_path):
    text = (CASES / "four_bar.toml").read_text(encoding="utf-8")
    load = '[[loads]]\nname = "push"\nbody = "rocker"\nmarker = "tip"\nframe = "inertial"\nforce = [0, -5, 0]\n'
    sprung = text.replace('rate = "4 rad/s"', "stiffness = 20\nrest = 0.4") + load
    for name, words in (("loose", text), ("sprung", sprung)):
        (tmp_path / f"{name}.toml").write_text(words, encoding="utf-8")
    code, out, _ = told("equilibrium", tmp_path / "loose.toml")
    assert code == 0 and "neutral along" in out and "loop        closure carries 0 N" in out
    code, out, _ = told("equilibrium", tmp_path / "sprung.toml", "--json")
    found = json.loads(out)
    assert code == 0 and found["stable"] and found["gap"] < 1e-12 and not found["neutral"]
    # the coupler has hinges at both ends and no load between: it pulls along its own line
    root, tip = (np.array(found["markers"][f"coupler.{end}"]["position"]) for end in ("root", "tip"))
    force = np.array(found["loops"]["closure"]["force"])
    assert np.linalg.norm(force) > 1.0
    assert np.linalg.norm(np.cross(force, tip - root)) < 1e-7 * np.linalg.norm(force) * np.linalg.norm(tip - root)


def test_mistakes_are_told(case, tmp_path):
    code, _, wrong = told("equilibrium", case(PUSH.format("inertial", "[0, 0, 1]")))
    assert code == 2 and "load 'push' keeps its direction in the inertial frame" in wrong
    ramp = PUSH.format("body", "[[0, 0, 0], [0, 0, 2]]") + "times = [0, 1]\n"
    code, _, wrong = told("equilibrium", case(ramp))
    assert code == 2 and "load 'push' changes over time" in wrong and "--at" in wrong
    assert told("equilibrium", case(ramp), "--at", "0.5")[0] == 0
    code, _, wrong = told("run", case(START.format("none.h5")))
    assert code == 2 and "initial.from" in wrong and "does not exist" in wrong
    code, _, wrong = told("run", case("\n[initial]\nform = 'eq.h5'\n"))
    assert code == 2 and "initial.form" in wrong and "from" in wrong
    assert told("equilibrium", case("", "other.toml"), "-o", tmp_path / "eq.h5")[0] == 0
    other = case(START.format("eq.h5"))
    other.write_text(other.read_text().replace('name = "hinge"', 'name = "axle"'))
    code, _, wrong = told("run", other)
    assert code == 2 and "which is of another craft" in wrong
    assert "hinge.angle is only there, axle.angle only here" in wrong


def test_a_body_is_not_started_twice(craft, write_case, tmp_path):
    path = write_case(craft + START.format("eq.h5"))
    (tmp_path / "eq.h5").write_bytes(b"")
    code, _, wrong = told("run", path)
    assert code == 2 and "found an initial state of the body together with [initial] from = 'eq.h5'" in wrong
    assert (
        "is not a result file"
        in told(
            "run",
            write_case(
                craft.replace('initial = { marker = "tip", displacement = [0, "10 mm", 0] }\n', "")
                + START.format("eq.h5")
            ),
        )[2]
    )


LOADED = """
title = "cantilever under a weight at its tip"

[run]
duration = 1

[sections.rod]
kind = "stiffness"
EA = "2.8e9 N"
EIy = "14000 N m^2"
EIz = "14000 N m^2"
GJ = "12000 N m^2"
mass_per_length = "1.2 kg/m"
ry = "2.24 mm"
rz = "2.24 mm"

[bodies.beam]
kind = "flexible"
mesh = "{mesh}"
members = [{{ group = "beam", family = "beam", section = "rod" }}]
reduction = {{ method = "cantilever", clamp = "root", modes = 4, derivatives = "auto" }}
strain = "{strain}"
markers.root = {{ group = "root" }}
markers.tip = {{ group = "tip" }}

[[joints]]
kind = "weld"
child = "beam"
child_marker = "root"

[[loads]]
name = "weight"
body = "beam"
marker = "tip"
frame = "inertial"
force = [0, 0, {force}]
"""
BEAM = Path(__file__).parents[2] / "meshes" / "beam10.msh"


def test_stretch_coordinates_do_not_hold_up_the_way_to_an_equilibrium(tmp_path):
    """Stretch is 2e5 times stiffer than bending: every step of bending leaves large forces for the next step to take.

    Nonlinear and condensed strain are two formulations of one body: their tips agree.
    """
    tips = []
    for strain in ("nonlinear", "condensed"):
        case = tmp_path / f"{strain}.toml"
        case.write_text(LOADED.format(mesh=BEAM, strain=strain, force=-14))
        code, out, err = told("equilibrium", case, "--json")
        assert (code, err) == (0, "")
        found = json.loads(out)
        assert found["iterations"] < 150  # with the forces themselves as the measure it took thousands, or gave up
        tips.append(found["markers"]["beam.tip"]["deflection"])
    np.testing.assert_allclose(tips[0], tips[1], rtol=1e-4, atol=1e-5)  # of 0.3 m; derivatives are a choice of them


@pytest.mark.parametrize(("strain", "bound"), [("linear", "10%"), ("condensed", "20%")])
@pytest.mark.filterwarnings("ignore:.*linear buckling load")  # its load is near that too
def test_an_equilibrium_bent_beyond_its_strain_is_warned_of_with_both_numbers(tmp_path, strain, bound):
    case = tmp_path / "bent.toml"
    text = LOADED.format(mesh=BEAM, strain=strain, force=-400)
    case.write_text(text.replace(', derivatives = "auto"', "") if strain == "linear" else text)
    with pytest.warns(PhysicsWarning, match=rf"'beam' is displaced by .* m, .*% of its size.* up to about {bound}"):
        balanced(read_case(case))


FALLING = """
[run]
duration = "1 s"
samples = 3

[environment]
gravity = [0, 0, -9.81]

[bodies.rod]
kind = "rigid"
mass = 2
inertia = [0.01, 0.2, 0.2]
center_of_mass = [0.5, 0, 0]

[[joints]]
kind = "revolute"
child = "rod"
name = "hinge"
axis = [0, 1, 0]
angle = "-90 deg"
"""


def test_an_unstable_equilibrium_is_left_when_asked(tmp_path):
    path = tmp_path / "upright.toml"
    path.write_text(FALLING)
    code, said, _ = told("equilibrium", path)
    assert code == 0 and "unstable: a small motion grows monotonically" in said and "--stable leaves it" in said
    code, said, _ = told("equilibrium", path, "--stable")
    assert code == 0 and "left        an equilibrium that is unstable" in said and "stability   stable" in said
    data = json.loads(told("equilibrium", path, "--stable", "--json")[1])
    assert np.sin(data["coordinates"]["hinge.angle"]) == pytest.approx(1.0) and data["stable"]
    assert data["left_growth"] == pytest.approx(np.sqrt(2 * 9.81 * 0.5 / (0.2 + 2 * 0.25)), rel=1e-6)


def test_a_condensed_column_near_eulers_load_is_told_to_bend_too_little(tmp_path):
    euler = np.pi**2 * 1e4 / (4 * 3.0**2)
    text = f"""
[run]
duration = 1
samples = 3
[attitude]
held = true
[bodies.boom]
kind = "analytic"
length = 3
mass_per_length = 1
EA = 1e7
EIy = 1e4
EIz = 1e4
GJ = 1e4
functions = {{ y = 4, z = 4 }}
strain = "condensed"
[[loads]]
name = "weight"
body = "boom"
marker = "tip"
force = [{-0.95 * euler}, 0, 1]
"""
    path = tmp_path / "column.toml"
    path.write_text(text)
    with pytest.warns(
        PhysicsWarning, match=r"0\.95 of the linear buckling load; above 0\.9 of it, condensed strain gives"
    ):
        balanced(read_case(path))


def test_rolling_leaves_no_equilibrium_to_find():
    code, _, wrong = told("equilibrium", CASES / "rolling_disc.toml")
    assert code == 2 and "nonholonomic constraints restrict velocities and not positions" in wrong


STILL = """
[run]
duration = 1
output_step = 0.1

[bodies.hub]
kind = "rigid"
mass = 200
inertia = [120, 100, 140]

[[joints]]
kind = "weld"
child = "hub"
"""


def test_a_craft_without_coordinates_is_refused_in_a_sentence(write_case, femflex):
    code, _, err = femflex("equilibrium", write_case(STILL))
    assert code == 2 and "the craft has no free coordinate" in err and "a free joint" in err


def test_a_craft_whose_coordinates_are_all_held_has_no_stability_to_tell(write_case, femflex):
    held = STILL.replace('"weld"', '"revolute"') + 'axis = "z"\nmotion = { angle = "locked" }\n'
    code, out, _ = femflex("equilibrium", write_case(held))
    assert code == 0 and "stability   nothing is free to move" in out


def test_a_small_deflection_of_a_long_boom_is_told():
    """P L^3 / 3 EI = 1.7e-5 m of 10 m; what is 0 but for rounding is 0."""
    from femflex import equilibrium
    from femflex.cli.equilibrium import markers
    from femflex.reduction import BeamFunctions, UniformBeam, beam_body
    from femflex.system import Load, System, weld

    boom = UniformBeam(10.0, EA=1e7, EIy=2e4, EIz=2e4, GJ=1e4, mass_per_length=1.0)
    body = beam_body(boom, BeamFunctions(y=4, z=4, tip=True))
    push = Load("push", "boom", "tip", force=np.array([0.0, 0.0, 1e-3]))
    found = markers(equilibrium(System({"boom": body}, (weld("boom", child_marker="root"),), (push,))))
    assert found["boom.tip"]["position"] == pytest.approx([10.0, 0.0, 1e-3 * 1e3 / 6e4], rel=1e-6)
    assert found["boom.tip"]["deflection"][:2] == [0.0, 0.0] and found["boom.tip"]["deflection"][2] > 1e-5
