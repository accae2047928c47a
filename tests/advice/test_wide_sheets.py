"""Sheets so wide and thin that large bends flatten them across: right by default, and reported."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from support.advised_bodies import noted_system

import femflex
from femflex.case.read import parse_case

MESHES = Path(__file__).parents[2] / "meshes"
SHEET = """
[run]
duration = 1.0
[environment]
gravity = {gravity}
[materials.al]
E = "70 GPa"
nu = 0.3
density = "2700 kg/m^3"
[sections.sheet]
kind = "plate"
thickness = "{thickness} mm"
[bodies.plate]
kind = "flexible"
mesh = "{mesh}"
members = [{{ group = "plate", family = "plate_bfs", section = "sheet", material = "al" }}]
reduction = {{ method = "cantilever", clamp = "root", modes = {modes}{more} }}
{strain}
markers.corner = {{ group = "corner" }}
[[joints]]
kind = "weld"
child = "plate"
child_marker = "root"
"""
EDGES = 0.025  # most by which strips along the edges, which curve crosswise freely, let a sheet sag further


def sheet(thickness, more="", gravity=4.0, modes=4, strain='strain = "condensed"'):
    mesh = (MESHES / "plate.msh").as_posix()
    text = SHEET.format(mesh=mesh, thickness=thickness, more=more, gravity=gravity, modes=modes, strain=strain)
    return noted_system(parse_case(text, MESHES / "sheet.toml"))


def sag(system):
    found = femflex.equilibrium(system)
    channels = found.model.observe(np.zeros(1), found.x[None])
    return -channels["markers/plate.corner/deflection"][0, 2]


def elastica(thickness, gravity):
    """Tip sag of a sheet of length 1 that bends into a cylinder: D theta'' = -q (1 - s) cos theta, w' = sin theta."""
    q, D = 2700 * thickness * gravity, 70e9 * thickness**3 / 12 / (1 - 0.3**2)
    s = np.linspace(0, 1, 50)
    slope = q / D * (s / 2 - s**2 / 2 + s**3 / 6)
    found = solve_bvp(
        lambda s, y: np.array([y[1], -q / D * (1 - s) * np.cos(y[0]), np.sin(y[0])]),
        lambda root, tip: np.array([root[0], root[2], tip[1]]),
        s,
        np.array([slope, np.gradient(slope, s), slope * s / 2]),
        tol=1e-8,
    )
    assert found.success
    return found.y[2, -1]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("gravity", "modes"), [(2.0, 4), (4.0, 4), (9.81, 4), (9.81, 8)])
def test_a_wide_thin_sheet_follows_the_elastica_of_its_cylinder_by_default(gravity, modes):
    """Bent by 31 to 147 thicknesses; its modes and their static derivatives alone would be up to 37 % short."""
    system = sheet(1.5, gravity=gravity, modes=modes, strain="")
    expected = elastica(1.5e-3, gravity)
    assert 0.998 * expected < sag(system) < (1 + EDGES) * expected
    note = system.bodies["plate"].note
    assert "strain is condensed" in note and "bent by over 0.021 m, it loses its transverse" in note
    assert system.bodies["plate"].kinds.count("third derivative") == 1


@pytest.mark.slow
def test_what_a_case_says_of_third_derivatives_is_taken():
    none, one = (sheet(1.5, f", third_derivatives = {n}") for n in (0, 1))
    assert "loses its transverse (anticlastic) curvature" in none.bodies["plate"].note
    assert "Remove third_derivatives = 0" in none.bodies["plate"].note
    assert sag(none) < 0.85 * elastica(1.5e-3, 4.0)
    assert one.bodies["plate"].note == ""
    assert 0.99 < sag(one) / elastica(1.5e-3, 4.0) < 1 + EDGES


@pytest.mark.parametrize(("thickness", "strain"), [(10.0, "condensed"), (1.5, "linear")])
def test_plates_that_do_not_bend_so_far_get_no_third_derivative(thickness, strain):
    body = sheet(thickness, strain=f"strain = '{strain}'").bodies["plate"]
    assert "third derivative" not in body.kinds
    assert "sheet" not in body.note


def test_free_sheets_are_told_what_their_set_lacks():
    """The same sheet, thrown: a set without a clamp has no way of its own to bend so far."""
    mesh = (MESHES / "plate.msh").as_posix()
    text = SHEET.format(mesh=mesh, thickness=1.5, more="", gravity=0.0, modes=4, strain="strain = 'condensed'")
    text = text.replace('method = "cantilever", clamp = "root"', 'method = "free_free"')
    text = text.replace("markers.corner = {", "markers.root = {}\nmarkers.corner = {").replace(
        'kind = "weld"', 'kind = "free"'
    )
    note = noted_system(parse_case(text, MESHES / "sheet.toml")).bodies["plate"].note
    assert "loses its transverse (anticlastic) curvature" in note and "set third_derivatives = 2" in note
    more = noted_system(
        parse_case(text.replace("modes = 4", "modes = 4, third_derivatives = 2"), MESHES / "sheet.toml")
    )
    assert more.bodies["plate"].kinds.count("third derivative") == 2 and "curve" not in more.bodies["plate"].note
