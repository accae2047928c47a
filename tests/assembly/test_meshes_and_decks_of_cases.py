"""Bodies of meshes and decks of cases: preload, bushings, lay-ups, replaced values, in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femflex.assembly import build_part
from femflex.case import read_case
from femflex.case.read import parse_case
from femflex.mesh import rectangle, write_mesh
from femflex.pipeline.decisions import build_system

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


def case_of_text(tmp_path, text):
    path = tmp_path / "case.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return read_case(path)


def first_frequencies(tmp_path, text, name="cord"):
    body = build_part(case_of_text(tmp_path, text), name)
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


def test_masses_at_groups_pull_with_the_weight(tmp_path):
    text = "preload = { acceleration = [9.81, 0, 0], masses = { tip = 2000 } }\n"
    omega, _ = first_frequencies(
        tmp_path, CORD.replace('["x", "y", "z"] }', '["x", "y", "z"], tip = ["y", "z"] }') + text
    )
    assert omega[0] == pytest.approx(np.pi / 10 * np.sqrt(9.81 * (2000 + 1.5) / 0.3), rel=1e-3)  # nearly a string


def test_bushing_at_tip_gives_clamped_pinned_beam(tmp_path):
    spring = '[[bodies.bar.bushings]]\ngroup = "tip"\ntranslation = ["1e9 N/m", "1e9 N/m", "1e9 N/m"]\n'
    omega, _ = first_frequencies(tmp_path, BAR + spring, "bar")
    EI, mass = 70e9 * np.pi / 4 * 5e-3**4, 2700 * np.pi * 5e-3**2
    assert omega[0] == pytest.approx((3.926602 / 10) ** 2 * np.sqrt(EI / mass), rel=1e-4)  # clamped and pinned


CASE = """
title = "deck"
[run]
duration = "1 s"
[attitude]
frame = "inertial"
[bodies.mast]
kind = "flexible"
deck = "mast.bdf"
units = "mm-t-s"
{more}
reduction = {{ method = "cantilever", clamp = {clamp}, modes = 3 }}
strain = "linear"
markers = {{ instrument = {{ group = "node_100" }} }}
[[joints]]
kind = "weld"
child = "mast"
child_marker = "instrument"
"""


def body(more: str = "", clamp: str = '"supports"', units: str = "mm-t-s"):
    text = CASE.format(more=more, clamp=clamp).replace("mm-t-s", units)
    return build_part(parse_case(text, MESHES / "case.toml"), "mast")


def test_supports_of_case_control_clamp_like_their_set_and_node():
    one, two, three = body(), body(clamp='"spc_1"'), body(clamp='"node_1"')
    assert one.omega == pytest.approx(two.omega, rel=1e-12)
    assert one.omega == pytest.approx(three.omega, rel=1e-12)
    assert one.markers["instrument"].position == pytest.approx([3.0, 0, 0])


def test_values_of_the_deck_are_replaced():
    """Four times the stiffness of both planes doubles the frequencies of bending."""
    found = body('overrides = { mat_1 = { E = "280 GPa" } }').omega
    assert found[:2] == pytest.approx(2 * body().omega[:2], rel=1e-3)


def test_member_of_case_replaces_elements_of_a_property():
    more = 'members = [{ group = "pid_3", family = "beam", section = "rod", material = "steel" }]'
    text = CASE.format(more=more, clamp='"supports"')
    text += (
        '[materials.steel]\nE = "210 GPa"\nnu = 0.3\ndensity = 0\n[sections.rod]\nkind = "circle"\nradius = "20 mm"\n'
    )
    found = build_part(parse_case(text, MESHES / "case.toml"), "mast").omega[0]
    EI = 210e9 * np.pi / 4 * 0.02**4
    assert found == pytest.approx(np.sqrt(3 * EI / (4.0 * 3.0**3)), rel=3e-3)  # a mass of 4 kg on a massless cantilever


GEAR = '{ kind = "equation", terms = [{ group = "edge", component = "x", factor = 1.0 }, '
GEAR += '{ group = "hub point", component = "x", factor = -1.0 }] },'


LAYUP = """
[run]
duration = 0.1
output_step = 0.001
[materials.fibre]
kind = "orthotropic"
E1 = "140 GPa"
E2 = "10 GPa"
G12 = "5 GPa"
nu12 = 0.3
density = 1600
[sections.crossed]
kind = "layup"
plies = [{{ material = "fibre", thickness = "1 mm" }}, {{ material = "fibre", thickness = "1 mm", angle = "90 deg" }}]
[bodies.part]
kind = "flexible"
mesh = "part.msh"
members = [{{ group = "surface", family = "{family}", section = "crossed" }}]
reduction = {{ method = "cantilever", clamp = "left", modes = 2 }}
strain = "linear"
[[joints]]
kind = "weld"
child = "part"
child_marker = "left"
"""


def test_shell_of_two_crossed_plies_couples_stretch_and_bending(tmp_path):
    """Narrow strip: EI_eff = b / d*_11 of the laminate's flexibility, of A, B and D together (classical lamination)."""
    length, width, t = 1.0, 0.05, 1e-3
    write_mesh(tmp_path / "part.msh", rectangle(length, width, 20, 1, "quad"))
    body = build_system(parse_case(LAYUP.format(family="shell"), tmp_path / "part.toml")).bodies["part"]
    d = 1.0 - 0.3**2 * 10 / 140
    Q = np.array([[140e9, 3e9, 0], [3e9, 10e9, 0], [0, 0, 5e9 * d]]) / d
    crossed = Q[[1, 0, 2]][:, [1, 0, 2]]
    A, B, D = (Q + crossed) * t, (crossed - Q) * t**2 / 2, (Q + crossed) * t**3 / 3
    soft = np.linalg.inv(np.block([[A, B], [B, D]]))
    exact = 1.8751**2 * np.sqrt(1.0 / soft[3, 3] / (1600 * 2 * t * length**4))
    assert D[0, 0] * soft[3, 3] > 1.3  # what B takes of the stiffness
    assert body.omega[0] == pytest.approx(exact, rel=5e-3)
