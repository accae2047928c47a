"""Cases that spin up keep the static shapes of spin by themselves: motions, torques, a few modes or functions."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from support.advised_bodies import noted_system
from support.spin_up import KANE, TIMES

from femflex.case import read_case
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
TORQUE = """
[bodies.hub]
kind = "rigid"
mass = 10
inertia = [1000, 1000, 1000]

[[joints]]
kind = "revolute"
child = "hub"
axis = "z"

[[joints]]
kind = "weld"
parent = "hub"
child = "beam"
child_marker = "root"

[[loads]]
name = "wheel"
body = "hub"
torque = [0, 0, {}]
"""
KEPT = "static shapes of its loads (spin) "


def built(folder, text):
    shutil.copy(ROOT / "cases" / "spin_up.csv", folder)
    write_mesh(folder / "beam.msh", line([[0, 0, 0], [10, 0, 0]], 8))
    (folder / "case.toml").write_text(text)
    return noted_system(read_case(folder / "case.toml"))


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
    ("text", "kept", "said"),
    [
        *((MESHED.replace("modes = 4", f"modes = {n}"), f"modes = {n}", ", attachment = []") for n in (2, 3, 4)),
        *((ANALYTIC.replace("y = 2", f"y = {n}"), f"{{ y = {n}", ", spin = false") for n in (1, 2, 3, 4)),
    ],
    ids=[*(f"{n} modes" for n in (2, 3, 4)), *(f"{n} functions" for n in (1, 2, 3, 4))],
)
def test_kanes_spin_up_on_few_shapes_and_defaults_is_the_segmented_one(tmp_path, segmented, text, kept, said):
    """All along within 0.2 % of the peak, what condensed strain leaves out; without the shapes up to 0.8 % off."""
    reference, peak = segmented, np.abs(segmented).max()
    system = built(tmp_path, text + MOTION)
    assert KEPT in system.bodies["beam"].note
    assert np.abs(tip(system) - reference).max() < 2e-3 * peak
    bare = built(tmp_path, text.replace(kept, f"{kept}{said}") + MOTION)
    off = np.abs(tip(bare) - reference).max() / peak
    assert off > 4e-3 or kept in ("{ y = 3", "{ y = 4")


@pytest.mark.slow
@pytest.mark.parametrize("text", [MESHED, ANALYTIC], ids=["meshed", "analytic"])
def test_a_torque_that_spins_a_craft_up_counts_as_a_motion_does(tmp_path, text):
    """To 6.4 rad/s in 20 s by 450 N m on 1400 kg m^2; the first frequency is 3.8 rad/s. A hundredth of it does not."""
    fast, slow = (built(tmp_path, text + TORQUE.format(torque)).bodies["beam"] for torque in (450, 4.5))
    assert fast.strain_form == "condensed" and KEPT in fast.note
    assert KEPT not in slow.note
    # the static shapes of spin are those of the analytic beam's joint, which it keeps anyway
    assert slow.n_modes == fast.n_modes if text is ANALYTIC else slow.n_modes == 4 < fast.n_modes


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "old", "new"),
    [
        (MESHED, "modes = 4", "modes = 4, attachment = []"),
        (MESHED, "modes = 4", "modes = 4, spin = false"),
        (MESHED, "modes = 4", "modes = 10"),
        (ANALYTIC, "y = 2", "y = 2, static = false"),
        (ANALYTIC, "y = 2", "y = 2, spin = false"),
        (ANALYTIC, "y = 2", "y = 10"),
    ],
)
def test_shapes_that_are_said_or_many_stay_as_they_are(tmp_path, text, old, new):
    assert KEPT not in built(tmp_path, text.replace(old, new) + MOTION).bodies["beam"].note


def test_a_body_that_says_its_strain_keeps_them_too(tmp_path):
    said = MESHED.replace("markers.root", 'strain = "condensed"\nmarkers.root')
    body = built(tmp_path, said + MOTION).bodies["beam"]
    assert KEPT in body.note and body.kinds.count("attachment") == 4


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::femflex.warning.TruncationWarning")
def test_few_polynomials_are_told_how_many_a_spin_wants(tmp_path):
    few, enough = (
        built(tmp_path, ANALYTIC.replace("y = 2", f'y = {n}, family = "polynomial"') + MOTION).bodies["beam"].note
        for n in (3, 4)
    )
    assert "its 3 polynomials per direction. Give 4 or more" in few and "and with 5 within 0.25 %" in few
    assert "polynomials" not in enough
