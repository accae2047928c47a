"""`femflex modes` of a case: the modes of the whole craft, printed, drawn, expected and studied."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.hub_beam import exact_frequencies

CRAFT = """
title = "hub and beam"

[run]
duration = "0.1 s"
samples = 3

[bodies.hub]
kind = "rigid"
mass = 0.5
inertia = [1, 1, 0.1]
markers.rim = {{ position = [0.1, 0, 0] }}

[bodies.beam]
kind = "analytic"
length = 1
EA = 1e4
EIy = 10
EIz = 1
GJ = 10
mass_per_length = 1
rotary_inertia = false
strain = "linear"
functions = {{ y = {modes}, z = 0 }}
damping = {{ ratio = 0.01 }}

[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "rim"
child = "beam"
child_marker = "root"

[study]
quantity = {{ of = "system_frequency", branch = "bending 1" }}
modes = [2, 4, 8]
tolerance = 1e-2

[[loads]]
name = "pulse"
body = "hub"
times = [0, 1]
torque = [[0, 0, 1], [0, 0, -1]]

[expect.first]
of = "system_frequency"
mode = {mode}
value = "{value} Hz"
relative_tolerance = 2e-3
source = "transcendental equation of a free hub with a beam"
"""
EXACT = exact_frequencies(0.1, 0.1, 0.5, False) / (2 * np.pi)


@pytest.fixture
def case(tmp_path):
    def write(modes=8, mode=7, value=EXACT[0], **more):
        path = tmp_path / "craft.toml"
        path.write_text(CRAFT.format(modes=modes, mode=mode, value=value))
        return path

    return write


def test_loops_of_sampled_controllers_are_said_to_be_open(femflex):
    code, out, err = femflex("modes", Path(__file__).parents[2] / "cases" / "detumble.toml")
    assert code == 0 and err == ""
    assert "held        commands of the sampled controllers gyro, demand, valves: their loops are open" in out
    assert out.count("craft 100 %") == 6


def test_the_table_has_rigid_modes_by_name_and_the_exact_frequencies(femflex, case):
    code, out, err = femflex("modes", case())
    assert code == 0 and err == ""
    assert "translation x" in out and "rotation z" in out and "bending 1" in out and f"{EXACT[0]:.3g}" in out
    assert "left out    load 'pulse'. Use --at TIME to evaluate them at a time" in out
    assert "stability   stable: no small motion grows" in out and "above 1e-08 of the larger of" in out
    assert "expected    first:" in out and "holds" in out
    short = femflex("modes", case(), "-n", "7")[1]
    assert "bending 1" in short and "bending 2" not in short and "modes above, which -n and --json list" in short


def test_ratios_that_differ_from_the_given_one_and_what_is_assessed_are_said(femflex, case):
    """On its light hub the beam's first mode is damped by more than the 1 % of the beam that is clamped."""
    path = case()
    ratio = json.loads(femflex("modes", path, "--json")[1])["modes"][6]["damping_ratio"]
    out = femflex("modes", path)[1]
    assert ratio > 0.011 and f"damping     mode 7 has a ratio of {ratio:.4g}, and body 'beam' is given 0.01" in out
    count = len(json.loads(femflex("modes", path, "--json")[1])["modes"]) - 6
    assert f"assessed    with richer sets of shapes: the first 3 of {count} elastic frequencies; `band` in [run]" in out
    path.write_text(path.read_text().replace("samples = 3", "samples = 3\nband = 500"))
    out = femflex("modes", path)[1]
    assert "elastic frequencies and those below 500 Hz" in out


def test_the_star_of_modes_that_grow_is_explained(femflex, tmp_path):
    """A pendulum that stands on its hinge falls with the root of m g l / J."""
    (tmp_path / "up.toml").write_text("""
        title = "upright pendulum"
        run = { duration = 1 }
        environment = { gravity = 9.81 }
        bodies.rod = { kind = "rigid", mass = 2, inertia = [1, 1, 1], markers.foot = { position = [0, 0, -1] } }
        [[joints]]
        kind = "revolute"
        child = "rod"
        child_marker = "foot"
        axis = [0, 1, 0]
    """)
    out = femflex("modes", "up.toml")[1]
    assert "-1*" in out and "*           the motion grows" in out
    assert f"{np.sqrt(2 * 9.81 / 3):.3g} 1/s at most" in out


def test_json_has_every_mode_with_damping_and_energies(femflex, case):
    code, out, _ = femflex("modes", case(), "--json")
    data = json.loads(out)
    assert code == 0 and data["stable"] and data["left_out"] == ["load 'pulse'"]
    rigid, elastic = ([mode for mode in data["modes"] if mode["rigid"] is flag] for flag in (True, False))
    assert len(rigid) == 6 and all(mode["frequency_hz"] == 0.0 for mode in rigid)
    damped = EXACT * np.sqrt(1 - np.array([mode["damping_ratio"] for mode in elastic[:3]]) ** 2)
    assert [mode["frequency_hz"] for mode in elastic[:3]] == pytest.approx(damped, rel=5e-5)
    for mode in elastic[:3]:
        assert 0.005 < mode["damping_ratio"] < 0.05  # of the beam alone 0.01; on a light hub it is damped more
        assert sum(mode["kinetic_energy"].values()) == pytest.approx(1.0)
        assert mode["omega_rad_s"] == pytest.approx(2 * np.pi * mode["frequency_hz"])


@pytest.mark.slow
def test_a_run_judges_what_is_expected_of_the_modes(femflex, case):
    code, out, err = femflex("run", case(), "-o", "run.h5")
    assert code == 0 and "expected    first:" in out and "holds" in out and "does not hold" not in err
    code, out, err = femflex("run", case(value=2 * EXACT[0]), "-o", "run.h5", "--force")
    assert "does not hold" in out and "first" in err


@pytest.mark.slow
def test_converge_studies_a_frequency_of_the_craft(femflex, case):
    path = case()
    path.write_text(path.read_text().replace("ratio = 0.01", "ratio = 0"))  # 0.02 of the craft lowers it by 2e-4
    code, out, _ = femflex("converge", path, "--over", "modes", "--json")
    found = json.loads(out)
    assert code == 0 and found["unit"] == "Hz"
    # static shapes of its joint make two modes enough (2e-10); four go without them (6e-6)
    assert found["values"] == pytest.approx([EXACT[0]] * len(found["values"]), rel=2e-5)
    assert "frequency of bending 1 of the craft" in femflex("converge", case(), "--over", "modes")[1]


@pytest.mark.slow
def test_the_montage_and_the_movie_are_drawn(femflex, case, tmp_path):
    from matplotlib.image import imread

    code, out, err = femflex("modes", case(modes=2), "-o", "m.png", "-o", "m.mp4", "--mode", "7")
    assert code == 0 and "picture     m.png" in out and "movie       m.mp4" in out, err
    picture = imread(tmp_path / "m.png")
    assert picture.shape[0] > 300 and picture[..., :3].std() > 0.02
    assert (tmp_path / "m.mp4").stat().st_size > 5000
    assert "m.png" in femflex("modes", case(), "-o", "m.png")[2]  # it is there now


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("-o", "m.jpg"), "-o m.jpg: found the suffix '.jpg'; expected .png for a picture; .mp4 for a movie"),
        (("-o", "m.png", "-o", "n.png"), "found -o m.png and -o n.png, both for the picture; give one"),
        (("--at", "3 m"), "--at: "),
        (("--mode", "3"), "--mode names the mode of a movie; give -o mode.mp4 with it"),
        (("-o", "m.mp4", "--mode", "99"), "--mode is 99; the modes of the craft are 1 to"),
        (("--body", "beam", "--at", "1"), "movies, --mode and --at are for the modes of a craft"),
    ],
)
def test_mistakes_are_answered_in_one_sentence(femflex, case, options, said, tmp_path):
    code, _, err = femflex("modes", case(modes=2), *options)
    assert code == 2 and said in err and not list(tmp_path.glob("m.*"))


def test_a_mode_that_is_not_there_is_named(femflex, case):
    code, _, err = femflex("modes", case(mode=99))
    assert code == 2 and "the craft has no mode 99; its modes are 1 to" in err


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('channel = "markers/beam.tip/deflection"', "with a channel or a body; it is a quantity of the whole craft"),
        ("speed = 1", "branch and speed go with of = 'campbell_frequency', which needs both"),
    ],
)
def test_a_frequency_of_the_craft_has_no_channel_and_no_speed(femflex, case, more, said):
    path = case()
    path.write_text(path.read_text() + more + "\n")
    code, _, err = femflex("check", path)
    assert code == 2 and said in err


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "drawn"), [(None, 7), (9, 9)])
def test_the_movie_is_of_the_first_mode_that_is_not_rigid_unless_named(case, mode, drawn, tmp_path, monkeypatch):
    import femflex.view
    from femflex.case import read_case
    from femflex.cli.craft_modes import Drawing
    from femflex.pipeline.balanced import case_modes

    captions = []
    monkeypatch.setattr(
        femflex.view, "craft_movie", lambda skin, caption, path, **more: captions.append(caption) or path
    )
    drawing = Drawing(picture=None, movie=tmp_path / "m.mp4", mode=mode, force=False)
    drawing.make(case_modes(read_case(case())), "hub and beam")
    assert [caption.split(" · ")[0] for caption in captions] == [str(drawn)]
