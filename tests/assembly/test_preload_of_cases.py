"""Preloads, tethers, membranes and bushings as cases say them, and what is refused before a run."""

from pathlib import Path

import numpy as np
import pytest

from femflex.assembly import build_part
from femflex.case import CaseError, read_case

MESHES = Path(__file__).resolve().parents[2] / "meshes"
HEAD = """
[run]
duration = "1 s"
[sections.cord]
kind = "cable"
EA = "1e7 N"
mass_per_length = "0.3 kg/m"
[materials.metal]
E = "70 GPa"
density = 2700
[sections.bar]
kind = "circle"
radius = "5 mm"
"""
CORD = f"""
[bodies.cord]
kind = "flexible"
mesh = "{MESHES / "beam10.msh"}"
members = [{{ group = "beam", family = "tether", section = "cord" }}]
reduction = {{ method = "cantilever", clamp = {{ root = ["x", "y", "z"] }}, modes = 4, attachment = [] }}
"""
BAR = f"""
[bodies.bar]
kind = "flexible"
mesh = "{MESHES / "beam10.msh"}"
members = [{{ group = "beam", family = "beam", section = "bar", material = "metal" }}]
reduction = {{ method = "cantilever", clamp = "root", modes = 4 }}
"""


def read(tmp_path, text):
    path = tmp_path / "case.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return read_case(path)


def first_frequencies(tmp_path, text, name="cord"):
    body = build_part(read(tmp_path, text), name)
    return body.omega[np.isfinite(body.omega)][:4], body


def test_a_spin_gives_the_frequencies_of_its_flap(tmp_path):
    omega, body = first_frequencies(tmp_path, CORD + "preload = { spin = [0, 0, 2] }\n")
    assert omega == pytest.approx(2 * np.sqrt([1, 1, 6, 6]), rel=1e-5)
    assert body.condensed


def test_the_orbit_of_the_case_gives_its_rate(tmp_path):
    field = "preload = { orbit = { vertical = [1, 0, 0], normal = [0, 0, 1] } }\n"
    orbit = "[orbit]\nsemi_major_axis = 7e6\n"
    omega, _ = first_frequencies(tmp_path, CORD + 'strain = "linear"\n' + field + orbit)
    n = np.sqrt(3.986004418e14 / 7e6**3)
    assert omega == pytest.approx(n * np.sqrt([3, 3, 18, 18]), rel=1e-4)
    with pytest.raises(CaseError, match=r"found no rate, and the case has no \[orbit\]"):
        build_part(read(tmp_path, CORD + field), "cord")


def test_masses_at_groups_pull_with_the_weight(tmp_path):
    text = "preload = { acceleration = [9.81, 0, 0], masses = { tip = 2000 } }\n"
    omega, _ = first_frequencies(
        tmp_path, CORD.replace('["x", "y", "z"] }', '["x", "y", "z"], tip = ["y", "z"] }') + text
    )
    assert omega[0] == pytest.approx(np.pi / 10 * np.sqrt(9.81 * (2000 + 1.5) / 0.3), rel=1e-3)  # nearly a string


def test_bushings_stand_in_the_body(tmp_path):
    spring = '[[bodies.bar.bushings]]\ngroup = "tip"\ntranslation = ["1e9 N/m", "1e9 N/m", "1e9 N/m"]\n'
    omega, _ = first_frequencies(tmp_path, BAR + spring, "bar")
    EI, mass = 70e9 * np.pi / 4 * 5e-3**4, 2700 * np.pi * 5e-3**2
    assert omega[0] == pytest.approx((3.926602 / 10) ** 2 * np.sqrt(EI / mass), rel=1e-4)  # clamped and pinned


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (CORD, "tether on group 'beam' has no tension"),
        (CORD + "preload = { origin = [1, 0, 0] }\n", "found no load; give acceleration, spin, orbit or forces"),
        (
            CORD + "preload = { spin = [0, 0, 1], orbit = { vertical = [1, 0, 0], normal = [0, 0, 1] } }\n",
            "found spin and orbit together",
        ),
        (CORD + "preload = { acceleration = [9.81, 0, 0], masses = { tipp = 1 } }\n", "did you mean 'tip'"),
        (
            CORD + "preload = { orbit = { vertical = [1, 0, 0], normal = [1, 0, 1], rate = 1e-3 } }\n",
            "are not at right angles",
        ),
        (
            CORD.replace('section = "cord"', 'section = "cord", segments = 2'),
            "segments in a member of the family tether",
        ),
        (CORD.replace('"tether", section = "cord"', '"beam", section = "cord"'), "give one of femflex.fem.sections"),
        (BAR + '[[bodies.bar.bushings]]\ngroup = "tip"\n', "found no stiffness"),
        (BAR + '[[bodies.bar.bushings]]\ngroup = "tip"\nstiffness = 1\n', "a spring along a line needs its other node"),
        (
            BAR + '[[bodies.bar.bushings]]\ngroup = "tip"\nto = "root"\nstiffness = 1\nrotation = [1, 1, 1]\n',
            "found stiffness together with rotation",
        ),
        (BAR + "[environment]\noblateness = 1e-3\n", "environment.oblateness needs an orbit"),
    ],
)
def test_what_cannot_be_is_refused_before_the_run(tmp_path, text, sentence):
    with pytest.raises(CaseError, match=sentence):
        case = read(tmp_path, text)
        build_part(case, next(iter(case.bodies)))


def test_a_body_in_tension_keeps_second_order_axial_strain_unless_its_strain_is_stated(tmp_path):
    assert read(tmp_path, CORD).bodies["cord"].strain == "condensed"
    without = CORD.replace("modes = 4", 'modes = 4, derivatives = "none"')
    assert read(tmp_path, without).bodies["cord"].strain == "linear"
    assert read(tmp_path, CORD + 'strain = "nonlinear"\n').bodies["cord"].strain == "nonlinear"
    assert read(tmp_path, BAR).bodies["bar"].strain is None
    assert read(tmp_path, BAR + "preload = { spin = [0, 0, 2] }\n").bodies["bar"].strain == "condensed"
