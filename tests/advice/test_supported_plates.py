"""Plates of automatic strain under pressure, deflected by up to three thicknesses, against von Karman and Levy."""

import warnings
from functools import cache

import numpy as np
import pytest
from support.von_karman import Plate

import femflex
from femflex.case.read import parse_case
from femflex.mesh import rectangle, write_mesh

H, E, NU, RHO = 0.01, 70e9, 0.316, 2700.0  # of a square of unit sides
LEVY_LOADS = np.array([12.1, 29.4, 56.9, 99.4, 161.0, 247.0, 358.0, 497.0])  # p a^4 / E h^4
LEVY = np.array([0.486, 0.962, 1.424, 1.870, 2.307, 2.742, 3.174, 3.600])  # of the centre over h, NACA Report 737
ALONG_Y, ALONG_X = '["x", "z", "rx"]', '["y", "z", "ry"]'
CLAMPS = {
    "clamped": '["left", "right", "bottom", "top"]',
    "immovable": f"{{left = {ALONG_Y}, right = {ALONG_Y}, bottom = {ALONG_X}, top = {ALONG_X}}}",
    "movable": '{left = ["z", "rx"], right = ["z", "rx"], bottom = ["z", "ry"], top = ["z", "ry"], '
    'middle = ["x", "y"], east = ["y"]}',
}
PLATE = """
[run]
duration = 1.0
[environment]
gravity = [0, 0, {gravity}]
[materials.metal]
E = {E}
nu = {NU}
density = {RHO}
[sections.sheet]
kind = "plate"
thickness = {H}
[bodies.plate]
kind = "flexible"
mesh = "plate.msh"
members = [{{ group = "surface", family = "plate_bfs", section = "sheet", material = "metal" }}]
reduction = {{ method = "cantilever", clamp = {clamp}, modes = {modes} }}
markers.middle = {{}}
markers.corner = {{ group = "bottom_left" }}
[[joints]]
kind = "weld"
child = "plate"
child_marker = "corner"
"""


@cache
def exact(support, load):
    """Deflection of the middle over the thickness by Ritz's method."""
    edges = {"clamped": "held", "immovable": "immovable", "movable": "free"}[support]
    return Plate(0.5, 0.5, H, E, NU, support == "clamped", edges).centres([load * E * H**4])[0] / H


def plate(folder, support, load, modes):
    """The plate of a case with automatic strain, and its middle's deflection over the thickness."""
    mesh = rectangle(1.0, 1.0, 8, 8, "quad")
    places = {name: [mesh.nearest_point(at)] for name, at in (("middle", [0.5, 0.5, 0]), ("east", [1, 0.5, 0]))}
    write_mesh(folder / "plate.msh", mesh.with_groups(points=places))
    gravity = -load * E * H**3 / RHO
    values = {"gravity": gravity, "E": E, "NU": NU, "RHO": RHO, "H": H, "clamp": CLAMPS[support], "modes": modes}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of bends estimated by linear strain
        system = femflex.build_system(parse_case(PLATE.format(**values), folder / "plate.toml"))
        state = femflex.equilibrium(system)
    channels = state.model.observe(np.zeros(1), state.x[None])
    return system.bodies["plate"], -channels["markers/plate.middle/deflection"][0, 2] / H


@pytest.mark.slow
def test_ritz_solution_matches_levy():
    """Simply supported, edges straight and free to draw in; Levy takes six terms."""
    deflections = Plate(0.5, 0.5, H, E, NU, False, "straight").centres(LEVY_LOADS * E * H**4) / H
    np.testing.assert_allclose(deflections, LEVY, rtol=8e-3)
    np.testing.assert_allclose(deflections[:5], LEVY[:5], rtol=6e-3)


def test_clamped_plate_of_automatic_strain_is_nonlinear(tmp_path):
    """At 1.1 thicknesses linear strain would be 75 % too soft, though that is 1 % of its size."""
    _, w = plate(tmp_path, "clamped", 134.9, 4)
    assert w == pytest.approx(exact("clamped", 134.9), rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("support", "load", "modes", "within"),
    [
        ("clamped", 17.79, 4, 5e-4),
        ("clamped", 402.0, 4, 1.5e-2),
        ("clamped", 402.0, 8, 2.5e-3),
        ("clamped", 1500.0, 8, 4e-3),
        ("immovable", 12.1, 4, 1e-3),
        ("immovable", 358.0, 4, 1e-2),
        ("immovable", 1100.0, 4, 2e-2),
        ("movable", 12.1, 4, 1e-3),
        ("movable", 56.9, 4, 4e-3),
        ("movable", 161.0, 4, 1e-2),
    ],
)
def test_plates_of_automatic_strain_match_von_karman(tmp_path, support, load, modes, within):
    """Of four modes of a square three are odd about a line through its middle: one, and the load's shape, answer."""
    _, w = plate(tmp_path, support, load, modes)
    assert w == pytest.approx(exact(support, load), rel=within)
