"""Sheets so wide and thin that large bends flatten them across: named before the run, right with what is advised."""

from pathlib import Path

import numpy as np
import pytest

import femflex
from femflex.case.builders import build_system
from femflex.case.read import parse_case

MESHES = Path(__file__).parents[2] / "meshes"
SHEET = """
[run]
duration = 1.0
[environment]
gravity = 4
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
reduction = {{ method = "cantilever", clamp = "root", modes = 4{more} }}
strain = "condensed"
markers.corner = {{ group = "corner" }}
[[joints]]
kind = "weld"
child = "plate"
child_marker = "root"
"""
FLAT_ACROSS = 0.0930  # m: elastica of the cylindrical bend, D = E h^3 / 12 (1 - nu^2), own weight, by shooting


def sheet(thickness, more=""):
    text = SHEET.format(mesh=(MESHES / "plate.msh").as_posix(), thickness=thickness, more=more)
    return build_system(parse_case(text, MESHES / "sheet.toml"))


@pytest.mark.parametrize(("thickness", "more"), [(1.5, ", third_derivatives = 1"), (10.0, "")])
def test_nothing_is_said_of_a_sheet_that_holds(thickness, more):
    assert "sheet" not in sheet(thickness, more).bodies["plate"].note


def test_a_wide_thin_sheet_is_named_and_what_is_advised_mends_it():
    assert "a sheet 0.6 m wide and 0.0015 m thick, bent by more than some 0.021 m" in sheet(1.5).bodies["plate"].note
    system = sheet(1.5, ", third_derivatives = 1")
    found = femflex.equilibrium(system)
    channels = found.model.observe(np.zeros(1), found.x[None])
    sag = -channels["markers/plate.corner/deflection"][0, 2]
    assert FLAT_ACROSS < sag < 1.01 * FLAT_ACROSS
