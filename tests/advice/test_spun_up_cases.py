"""Cases that spin up on few modes or functions, all choices automatic."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from support.spin_up import KANE, TIMES

import femflex
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.mesh import line, write_mesh

ROOT = Path(__file__).parents[2]
SECTION = """EA = 2.8e7
EIy = 1.4e4
EIz = 1.4e4
GJ = 1.4e4
mass_per_length = 1.2
ry = 0.02236
rz = 0.02236
"""
MESHED = f"""
[run]
duration = 20
samples = 401

[sections.bar]
kind = "stiffness"
{SECTION}
[bodies.beam]
kind = "flexible"
mesh = "beam.msh"
members = [{{ group = "line", family = "beam", section = "bar", options = {{ order = 5 }} }}]
reduction = {{ method = "cantilever", clamp = "start", modes = 4 }}
markers.root.group = "start"
markers.tip.group = "end"
"""
ANALYTIC = f"""
[run]
duration = 20
samples = 401

[bodies.beam]
kind = "analytic"
length = 10
{SECTION}functions = {{ y = 2 }}
"""
MOTION = """
[[joints]]
kind = "revolute"
child = "beam"
child_marker = "root"
axis = "z"
motion.angle = { kind = "table", file = "spin_up.csv", column = "angle", degree = 5 }
"""


def built(folder, text):
    shutil.copy(ROOT / "cases" / "spin_up.csv", folder)
    write_mesh(folder / "beam.msh", line([[0, 0, 0], [10, 0, 0]], 8))
    (folder / "case.toml").write_text(text)
    return femflex.build_system(femflex.read_case(folder / "case.toml"))


def tip(system):
    model = compile_system(system)
    states = integrator("dop853", rtol=1e-7, atol=1e-7).solve(model, TIMES, model.x0).states
    return model.observe(TIMES, states)["markers/beam.tip/deflection"]


@pytest.fixture(scope="module")
def segmented():
    """Deflection of the tip, extrapolated from 16 and 32 segments."""
    coarse, fine = KANE.segmented(16), KANE.segmented(32)
    return fine + (fine - coarse) / 3


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        *(MESHED.replace("modes = 4", f"modes = {n}") for n in (2, 3, 4)),
        *(ANALYTIC.replace("y = 2", f"y = {n}") for n in (1, 2, 3, 4)),
    ],
    ids=[*(f"{n} modes" for n in (2, 3, 4)), *(f"{n} functions" for n in (1, 2, 3, 4))],
)
def test_kane_spin_up_with_defaults_matches_segments(tmp_path, segmented, text):
    """The static shapes of the root, which the motion of the joint excites, are kept where few modes want them."""
    lag = tip(built(tmp_path, text + MOTION))
    assert np.abs(lag - segmented).max() < 6e-3 * np.abs(segmented).max()
