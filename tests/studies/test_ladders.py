"""Ladders over every kind of body that keeps a number of modes."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femflex.case import Case
from femflex.pipeline.case_bodies import build_body
from femflex.reduction import save_body
from femflex.studies import convergence, ladder, planned

Built = Callable[..., Case]

FREQUENCY = (
    'of = "value", channel = "markers/beam.tip/deflection", component = "y"',
    'of = "mode_frequency", body = "beam", mode = 1',
)
CANTILEVER = 'method = "cantilever", clamp = "ROOT", modes = 4'
MESHED = """kind = "flexible"
mesh = "beam.inp"
members = [{ group = "BEAM", family = "beam", section = "beam", options = { rotary_inertia = false } }]
reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }
markers.tip = { group = "TIP" }
"""
POLYNOMIALS = """kind = "analytic"
length = 4
EA = 1e5
EIy = 50
EIz = 100
GJ = 4
mass = 2
rotary_inertia = false
functions = { y = 3, z = 3, family = "polynomial" }
"""
EXACT = (1.8751040687119611 / 4.0) ** 2 * math.sqrt(50.0 / 0.5) / (2 * math.pi)  # clamped-free, EIy


def test_polynomials_converge_to_the_beam_and_the_verdict_covers_their_error(built: Built):
    case = built(FREQUENCY, (MESHED, POLYNOMIALS), ('child_marker = "ROOT"', 'child_marker = "root"'))
    found = convergence(case, "modes", [1, 2, 3, 4], 1e-3)
    assert found.counts.tolist() == [2, 4, 6, 8]
    error = np.abs(found.values / EXACT - 1)
    assert np.all(found.errors >= 0.95 * error * EXACT)
    assert abs(found.estimate - EXACT) < 1.2 * found.trend.spread  # errors fall faster than by either law
    assert found.recommended == found.levels[np.argmax(error < 1e-3)]
    assert "modes per body" in found.verdict


def test_interfaces_are_kept_at_every_level(built: Built):
    fixed = 'method = "craig_bampton", clamp = "ROOT", interfaces = ["TIP"], modes = 2, joints = {}'
    found = convergence(built(FREQUENCY, (CANTILEVER, fixed)), "modes", [1, 2, 4, 6])
    assert found.counts.tolist() == [7, 8, 10, 12]  # six of the tip
    assert np.all(np.diff(found.values) <= 1e-12) and found.values[0] > EXACT  # Rayleigh and Ritz
    assert found.values[-1] == pytest.approx(EXACT, rel=5e-5)  # of six elements


def test_modes_of_a_body_file_are_cut_up_to_what_it_holds(built: Built):
    plain = ("modes = 4 }", "modes = 4, joints = {} }")
    case = built(FREQUENCY, plain)
    save_body(case.path.parent / "beam.h5", build_body(case, "beam", modes=6))
    filed = built((MESHED, 'kind = "file"\nfile = "beam.h5"\n'))
    assert [rung.level for rung in planned(filed).ladder.rungs] == [1, 2, 3, 4, 6]
    direct, cut = convergence(built(plain), "modes", [2, 4, 6]), convergence(filed, "modes", [2, 4, 6])
    np.testing.assert_allclose(cut.values, direct.values, rtol=1e-9)


def test_damping_given_for_each_mode_limits_the_ladder(built: Built):
    damped = ("markers.tip", "damping = { ratio = [0.01, 0.02, 0.03, 0.04] }\nmarkers.tip")
    assert [rung.level for rung in planned(built(damped)).ladder.rungs] == [1, 2, 3, 4]


@pytest.mark.slow
def test_two_bodies_are_varied_together_or_one_alone(built: Built):
    joint = '\n[[joints]]\nkind = "weld"\nparent = "hub"\nchild = "other"\nchild_marker = "ROOT"\n\n[[loads]]'
    plain = ("modes = 4 }", "modes = 4, joints = {} }")
    other = ("[[joints]]", f"[bodies.other]\n{MESHED.replace('modes = 4', 'modes = 3, joints = {}')}\n[[joints]]")
    both = built(other, ("\n[[loads]]", joint), plain)
    found = convergence(both, "modes", [1, 2, 3])
    assert found.levels.tolist() == [1, 2, 3] and found.counts.tolist() == [2, 4, 6] and found.own is None
    one = built(other, ("\n[[loads]]", joint), plain, ("[study]", '[study]\nbody = "other"'))
    assert convergence(one, "modes", [1, 2, 3]).counts.tolist() == [1, 2, 3]
    assert planned(one, "mesh").ladder.varied == ("other",)
    assert planned(both, "mesh").ladder.varied == ("beam", "other")


def test_large_meshes_are_refined_twice_at_most_unless_more_is_asked_for(built: Built, monkeypatch: pytest.MonkeyPatch):
    assert [rung.level for rung in planned(built(FREQUENCY, cells=20), "mesh").ladder.rungs][:4] == [0, 1, 2, 3]
    monkeypatch.setattr(ladder, "POINTS", 100)  # 161 points after three refinements
    assert [rung.level for rung in planned(built(FREQUENCY, cells=20), "mesh").ladder.rungs] == [0, 1, 2]
    assert [rung.level for rung in planned(built(FREQUENCY, cells=20), "mesh", [0, 3]).ladder.rungs] == [0, 3]
    monkeypatch.setattr(ladder, "POINTS", 10)
    assert [rung.level for rung in planned(built(FREQUENCY, cells=20), "mesh").ladder.rungs] == [0, 1, 2]


@pytest.mark.slow
def test_segments_are_a_ladder_of_their_own():
    cases = Path(__file__).resolve().parents[2] / "cases"
    found = convergence(cases / "elastica.toml", "segments", [2, 4, 8])
    assert list(found.levels) == [2, 4, 8] and list(found.counts) == [12, 24, 48]
    assert found.order == pytest.approx(2.0, abs=0.3)
    assert "with order" in found.verdict and "in the length of a segment" in found.verdict
    with pytest.raises(ValueError, match="there is no line cut into segments"):
        convergence(cases / "panel_slew.toml", "segments")
