"""Which strain a body gets by its place in a system: attached bodies, supports, compression."""

from __future__ import annotations

import numpy as np
import pytest
from support.advised_bodies import noted_system

from femflex.case import read_case
from femflex.warning import PhysicsWarning

LENGTH, EI, LINE = 3.0, 1.0e4, 1.0
RUN = "\n[run]\nduration = 1\nsamples = 11\n"
BOOM = f"""
[bodies.boom]
kind = "analytic"
length = {LENGTH}
mass_per_length = {LINE}
EA = 1e7
EIy = {EI}
EIz = {EI}
GJ = 1e4
functions = {{ y = 4, z = 4 }}
"""
BEAM = RUN + '[attitude]\nframe = "spinning"\nspin = [0, 0, 0.5]\n' + BOOM
HELD = '[[joints]]\nkind = "weld"\nchild = "boom"\n'
HUB = """
[bodies.hub]
kind = "rigid"
mass = 1000
inertia = [1e5, 1e5, 1e5]
markers.rim = {{ position = [{}, 0, 0] }}
[[joints]]
kind = "weld"
child = "hub"
[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "rim"
child = "boom"
"""
TIP = """
[bodies.tip]
kind = "rigid"
mass = 2000
inertia = [1, 1, 1]
[[joints]]
kind = "weld"
parent = "boom"
parent_marker = "tip"
child = "tip"
"""


def boom(write_case, text):
    return noted_system(read_case(write_case(text))).bodies["boom"]


def told(note):
    return float(note.split("by ")[1].split("%")[0]) / 100


@pytest.mark.slow
def test_a_boom_alone_is_linear_and_what_it_bears_at_its_tip_makes_it_condensed(write_case):
    """A pull P stiffens a cantilever by P L^2 / EI (int phi'^2 / int phi''^2) = P L^2 / EI (4.6478 / 12.3624)."""
    assert boom(write_case, BEAM + HELD).strain.is_linear
    loaded = boom(write_case, BEAM + HELD + TIP)
    pull = 2000 * LENGTH * 0.5**2
    expected = np.sqrt(1 + pull * LENGTH**2 / EI * 4.6478 / 12.3624) - 1
    assert len(loaded.slaves) and "turning at 0.5 rad/s may raise the first frequency by" in loaded.note
    assert told(loaded.note) == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_a_boom_on_a_far_rim_is_condensed(write_case):
    assert boom(write_case, BEAM + HUB.format(0)).strain.is_linear
    far = boom(write_case, BEAM + HUB.format(400))
    assert len(far.slaves) and "may raise the first frequency" in far.note


@pytest.mark.slow
def test_a_boom_that_inertia_presses_inward_is_condensed(write_case):
    """A clamped column buckles under its own weight q L at q L^3 = 7.837 EI (Greenhill, 1881)."""
    press = 0.5 * 7.837 * EI / LENGTH**3 / LINE  # acceleration at half that
    inward = boom(write_case, BEAM + HUB.format(-press / 0.5**2))
    assert len(inward.slaves) and "axial compression (loads or inertia) may lower the first frequency" in inward.note
    assert told(inward.note) == pytest.approx(1 - np.sqrt(0.5), abs=0.02)
    with pytest.warns(PhysicsWarning, match=r"inertia and weight .* is 1.25 of the linear buckling load; 1.3 % past"):
        assert "buckling" in boom(write_case, BEAM + HUB.format(-2.5 * press / 0.5**2)).note


def test_a_boom_that_spins_about_its_own_length_is_not_said_to_stiffen(write_case):
    own = boom(write_case, (BEAM + HELD).replace("spin = [0, 0, 0.5]", "spin = [20, 0, 0]"))
    assert own.strain.is_linear and "turning at 20 rad/s changes its first frequency by less than 0.005%" in own.note


@pytest.mark.slow
def test_a_load_along_a_boom_counts_at_its_peak(write_case):
    euler = np.pi**2 * EI / (4 * LENGTH**2)
    load = f"""
[[loads]]
name = "push"
body = "boom"
marker = "tip"
times = [0, 0.5, 1]
force = [[0, 0, 0], [{-0.5 * euler}, 0, 0], [0, 0, 0]]
"""
    still = (BEAM + HELD).replace("spin = [0, 0, 0.5]", "spin = [0, 0, 0]").replace('frame = "spinning"\n', "")
    still = still.replace("spin = [0, 0, 0]\n", "")
    assert boom(write_case, still).note == "strain is linear: it does not turn; no load bends it"
    pushed = boom(write_case, still + load)
    assert told(pushed.note) == pytest.approx(1 - np.sqrt(1 - np.pi**2 / 8 * 4.6478 / 12.3624), abs=0.01)


def test_strain_that_is_said_stays(write_case):
    said = (BEAM + HELD + TIP).replace("functions =", 'strain = "linear"\nfunctions =')
    body = boom(write_case, said)
    assert body.strain.is_linear and body.note.startswith("4 static shapes of its joints")
