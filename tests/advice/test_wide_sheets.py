"""Sheets so wide and thin that large bends flatten them across: right by default, and reported."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_bvp

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
    return femflex.build_system(parse_case(text, MESHES / "sheet.toml"))


def sag(system):
    state = femflex.equilibrium(system)
    channels = state.model.observe(np.zeros(1), state.x[None])
    return -channels["markers/plate.corner/deflection"][0, 2]


def elastica(thickness, gravity):
    """Tip sag of a sheet of length 1 that bends into a cylinder: D theta'' = -q (1 - s) cos theta, w' = sin theta."""
    q, D = 2700 * thickness * gravity, 70e9 * thickness**3 / 12 / (1 - 0.3**2)
    s = np.linspace(0, 1, 50)
    slope = q / D * (s / 2 - s**2 / 2 + s**3 / 6)
    solution = solve_bvp(
        lambda s, y: np.array([y[1], -q / D * (1 - s) * np.cos(y[0]), np.sin(y[0])]),
        lambda root, tip: np.array([root[0], root[2], tip[1]]),
        s,
        np.array([slope, np.gradient(slope, s), slope * s / 2]),
        tol=1e-8,
    )
    assert solution.success
    return solution.y[2, -1]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("gravity", "modes"), [(2.0, 4), (4.0, 4), (9.81, 4), (9.81, 8)])
def test_wide_thin_sheet_matches_elastica_by_default(gravity, modes):
    """Bent by 31 to 147 thicknesses; its modes and their static derivatives alone would be up to 37 % short."""
    system = sheet(1.5, gravity=gravity, modes=modes, strain="")
    expected = elastica(1.5e-3, gravity)
    assert 0.998 * expected < sag(system) < (1 + EDGES) * expected
