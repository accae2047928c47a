"""Blades of case files that tune nothing: few modes, and the static shapes that a body under spin keeps by itself."""

from __future__ import annotations

import numpy as np
import pytest
from support.advised_bodies import noted_system
from support.rotating_beams import Rotating

from femflex.case import read_case
from femflex.mesh import line, write_mesh
from femflex.studies.campbell.sweep import spins

SPEEDS = np.array([0.0, 4.0, 12.0])
BLADE = """
[run]
duration = 1
samples = 11

[attitude]
frame = "spinning"
spin = [0, 0, 12]

[campbell]
speeds = "0:12:4"
modes = 6

[sections.spar]
kind = "stiffness"
EA = 1e6
EIy = 1
EIz = {lag}
GJ = 1
mass_per_length = 1
ry = 1e-3
rz = 1e-3

[bodies.hub]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
markers.seat = {{ position = [{hub}, 0, 0] }}

[bodies.blade]
kind = "flexible"
mesh = "blade.msh"
members = [{{ group = "line", family = "beam", section = "spar", options = {{ order = 4, orientation = {up} }} }}]
reduction = {{ method = "cantilever", clamp = "start", modes = {modes}{more} }}

[[joints]]
kind = "weld"
child = "hub"

[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "seat"
child = "blade"
child_marker = "start"
"""


def blade(folder, hub=0.0, lag=1.9, setting=0.0, modes=4, more=""):
    """The system of the case."""
    write_mesh(folder / "blade.msh", line([[0, 0, 0], [1, 0, 0]], 6))
    up = [0, float(np.cos(setting)), float(np.sin(setting))]
    (folder / "blade.toml").write_text(BLADE.format(hub=hub, lag=lag, up=up, modes=modes, more=more))
    return noted_system(read_case(folder / "blade.toml"))


def frequencies(system, count):
    """(n_speeds, count) the lowest, about the steady state at each speed."""
    found = {
        one.speed: np.sort(one.vibration.eigenvalues.imag[one.vibration.eigenvalues.imag > 0])[:count]
        for one, _ in spins(system, np.array([0, 0, 1.0]), SPEEDS, 6)
        if one.asked
    }
    return np.array([found[speed] for speed in SPEEDS])


@pytest.mark.slow
@pytest.mark.parametrize(("hub", "lag", "setting"), [(0.0, 1.9, 0.0), (1.0, 1.9, 0.0), (0.0, 3.0, 0.5)])
def test_a_blade_of_four_modes_has_the_exact_frequencies_up_to_twelve(tmp_path, hub, lag, setting):
    """Flap and lag, two of each, over spins up to 12 sqrt(EI / m L^4): eight coordinates."""
    system = blade(tmp_path, hub, lag, setting)
    body = system.bodies["blade"]
    assert body.n_modes == 8 and "(spin)" in body.note and body.strain_form == "condensed"
    for speed, found in zip(SPEEDS, frequencies(system, 4), strict=True):
        beam = Rotating(float(speed), hub=hub, lag=lag, setting=setting)
        exact = beam.exact(found, within=2e-3)
        assert found[:2] == pytest.approx(exact[:2], rel=5e-4)
        assert found == pytest.approx(exact, rel=1.5e-3)


@pytest.mark.slow
def test_eight_modes_alone_are_several_times_farther_off(tmp_path):
    found = frequencies(blade(tmp_path, modes=8, more=", attachment = []"), 2)[-1]
    assert np.abs(found / Rotating(12.0, lag=1.9).exact(found, within=5e-3) - 1).max() > 1e-3


ANALYTIC = """
[run]
duration = 1
samples = 11

[attitude]
frame = "spinning"
spin = [0, 0, 12]

[bodies.blade]
kind = "analytic"
length = 1
root = [1, 0, 0]
orientation = [0, 1, 0]
EA = 1e6
EIy = 1
EIz = 1.9
GJ = 1
mass_per_length = 1
functions = {{ y = 3, z = 3{more} }}

[[joints]]
kind = "weld"
child = "blade"
"""


@pytest.mark.slow
def test_an_analytic_blade_of_three_functions_has_them_too_on_a_hub_of_its_length(tmp_path):
    """With the static shapes of spin that it keeps by itself within 5e-4; without 1 % off in the second of each."""
    found = {}
    for more in ("", ", spin = false"):
        (tmp_path / "blade.toml").write_text(ANALYTIC.format(more=more))
        system = noted_system(read_case(tmp_path / "blade.toml"))
        found[more] = frequencies(system, 4)[-1]
        kept = "4 static shapes of its loads (spin)" in system.bodies["blade"].note
        assert kept == (not more)
    exact = Rotating(12.0, hub=1.0, lag=1.9).exact(found[""], within=2e-3)
    assert found[""] == pytest.approx(exact, rel=5e-4)
    assert np.abs(found[", spin = false"] / exact - 1).max() > 5e-3
